"""A page that is open in a browser: what it says, what it asks for, where the focus is, whether it can be read."""

from __future__ import annotations

from dataclasses import dataclass, field

LEAST_CONTRAST = 4.5  # of text, by the Web Content Accessibility Guidelines, level AA
MOST_TABS = 200  # more than a small page has controls
CONTRAST = """selectors => selectors.map(selector => {
  const light = colour => { const [r, g, b] = colour.match(/[\\d.]+/g).slice(0, 3).map(v => v / 255)
    .map(v => v <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4); return .2126 * r + .7152 * g + .0722 * b; };
  const text = document.querySelector(selector);
  let back = text, colour;
  do { colour = getComputedStyle(back).backgroundColor; back = back.parentElement; }
  while (colour.endsWith(", 0)") && back);
  const [low, high] = [light(getComputedStyle(text).color), light(colour)].sort((a, b) => a - b);
  return (high + .05) / (low + .05); })"""


@dataclass
class Visit:
    """An open page, what it said on the console, and every address that it asked for."""

    page: object
    said: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def focused(self, script="e => e.id || e.className || e.tagName"):
        return self.page.evaluate_handle("document.activeElement").evaluate(script)

    def tab_to(self, selector):
        """Press Tab until an element has the focus; each one on the way shows that it has it."""
        for _ in range(MOST_TABS):
            self.page.keyboard.press("Tab")
            if self.focused("e => e === document.body"):
                continue
            assert self.focused("e => getComputedStyle(e).outlineStyle") == "solid", self.focused()
            if self.focused(f"e => e.matches({selector!r})"):
                return
        raise AssertionError(f"no Tab reaches {selector}")

    def contrasts(self, selectors):
        """Of the text of each element."""
        return dict(zip(selectors, self.page.evaluate(CONTRAST, list(selectors)), strict=True))

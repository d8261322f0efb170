"""The page in a browser: sorted, filtered, opened by mouse and by keyboard alone, dark, narrow, and off the network."""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from pipelines.nightly.page.write import MOST_PICTURES, write_page
from tests.pipelines.nightly.page import synthetic

pytestmark = pytest.mark.full

LEAST_CONTRAST = 4.5  # of text, by the Web Content Accessibility Guidelines, level AA
MOST_TABS = 200  # more than the small page has controls
CONTRAST = """selectors => selectors.map(selector => {
  const light = colour => { const [r, g, b] = colour.match(/[\\d.]+/g).slice(0, 3).map(v => v / 255)
    .map(v => v <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4); return .2126 * r + .7152 * g + .0722 * b; };
  const text = document.querySelector(selector);
  let back = text, colour;
  do { colour = getComputedStyle(back).backgroundColor; back = back.parentElement; }
  while (colour.endsWith(", 0)") && back);
  const [low, high] = [light(getComputedStyle(text).color), light(colour)].sort((a, b) => a - b);
  return (high + .05) / (low + .05); })"""
TEXTS = (
    "h1", ".exit b", ".exit span", ".of span", ".strip b", ".strip span", ".state.passed", ".state.failed",
    ".state.warned", ".state.changed", ".state.not-run", ".mark.worse", ".mark.unconfirmed", ".mark.unproved",
    ".mark.equal", ".muted", ".changes a", ".opens", ".detail .mark.equal", "output", ".was", "pre",
)  # fmt: skip


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


@pytest.fixture(scope="module")
def browser():
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        pytest.fail("playwright is missing; `make test-full` installs it")
    names = ("chromium", "chromium-browser", "google-chrome")
    path = next(filter(None, map(shutil.which, names)), None)
    if path is None:
        pytest.fail("no Chromium is installed; `apt-get install chromium` on Debian")
    with sync_playwright() as started:
        # A browser's own sandbox does not run as root, as in a container.
        one = started.chromium.launch(executable_path=path, chromium_sandbox=os.geteuid() != 0)
        yield one
        one.close()


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    folder = tmp_path_factory.mktemp("small")
    history = synthetic.history(folder / "history", 6, 10)
    write_page(history, None, folder / "report.html", synthetic.pictures(2))
    return folder / "report.html"


@pytest.fixture
def visit(browser, small):
    """Open the small page, or another; at the end nothing has been said and nothing loaded."""
    visits = []

    def opened(path: Path = small, width=1280, scheme="light"):
        context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme, offline=True)
        new = Visit(context.new_page())
        new.page.on("console", lambda message: new.said.append(message.text))
        new.page.on("pageerror", lambda error: new.said.append(str(error)))
        new.page.on("request", lambda request: new.asked.append(request.url))
        new.page.goto(path.as_uri())
        visits.append((new, path))
        return new

    yield opened
    for each, path in visits:
        assert each.said == []
        assert [url for url in each.asked if not url.startswith("data:")] == [path.as_uri()]


def _slices(page):
    return page.eval_on_selector_all(".slices > tbody:not(.out)", "all => all.map(e => e.dataset.slice)")


def test_the_table_sorts(visit):
    page = visit().page
    first = _slices(page)
    head = page.locator("th[data-key=slice]")
    for state, wanted in (("ascending", sorted(first)), ("descending", sorted(first, reverse=True))):
        head.locator("button").click()
        assert head.get_attribute("aria-sort") == state
        assert page.locator("[aria-sort]").count() == 1
        assert _slices(page) == wanted
    page.locator("th[data-key=size] button").click()
    sizes = page.eval_on_selector_all(".slices > tbody", "all => all.map(e => +e.dataset.size)")
    assert sizes == sorted(sizes, reverse=True)  # the largest first
    page.locator("th[data-key=rank] button").click()
    assert _slices(page) == first


def test_the_table_filters(visit):
    page = visit().page
    page.fill("#filter", "EQUISOLID edge")
    assert _slices(page) == ["regime-0/equisolid/edge-fit"]
    assert page.locator("#count").inner_text() == "1 of 10 shown"
    page.fill("#filter", "")
    page.select_option("#kind", "changed")
    assert _slices(page) == ["regime-0/perspective/edge-fit"]
    page.select_option("#kind", "unconfirmed")
    assert _slices(page) == ["regime-0/orthogonal/best detected exact all"]
    page.fill("#filter", "nowhere")
    assert _slices(page) == []


def test_a_slice_opens_and_a_change_leads_to_it(visit):
    page = visit().page
    detail = page.locator("tbody[data-slice='regime-0/perspective/edge-fit'] .detail")
    assert not detail.is_visible()
    page.select_option("#kind", "equal")
    page.locator(".changes a").first.click()
    assert detail.is_visible()
    assert page.locator("tr tbody tr:visible").count() == 14  # seven metrics of two suites
    page.locator("tbody.open .opens").click()
    assert not detail.is_visible()


def test_a_frame_opens_large_and_closes(visit):
    page = visit().page
    page.locator(".sides").first.click()
    dialog = page.locator("dialog")
    assert dialog.is_visible()
    shown, small = (page.locator(f"{where} .sides svg").first.bounding_box() for where in ("dialog", "ul"))
    assert shown["width"] > 2.0 * small["width"]
    assert "The bar is an error of " in dialog.inner_text()
    page.locator("dialog button").click()
    assert not dialog.is_visible()


def test_the_keyboard_alone_is_enough(visit):
    here = visit()
    page = here.page
    page.keyboard.press("Tab")
    assert here.focused("e => e.className") == "skip"
    here.tab_to("#theme")
    here.tab_to(".strip a")
    assert page.locator("[role=tooltip]:visible").count() == 1
    here.tab_to("th[data-key=slice] button")
    page.keyboard.press("Enter")
    assert page.locator("th[data-key=slice]").get_attribute("aria-sort") == "ascending"
    here.tab_to(".opens")
    page.keyboard.press("Space")
    assert here.focused("e => e.getAttribute('aria-expanded')") == "true"
    here.tab_to(".enlarge")
    page.keyboard.press("Enter")
    assert page.locator("dialog").is_visible()
    page.keyboard.press("Escape")
    assert not page.locator("dialog").is_visible()
    assert here.focused("e => e.className") == "enlarge"
    here.tab_to("pre")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_both_themes_can_be_read(visit, scheme):
    page = visit(scheme=scheme).page
    page.locator(".opens").first.click()
    back = "+getComputedStyle(document.body).backgroundColor.match(/\\d+/)[0] < 128"
    for dark in (scheme == "dark", scheme != "dark"):
        assert page.evaluate(back) is dark
        ratios = dict(zip(TEXTS, page.evaluate(CONTRAST, list(TEXTS)), strict=True))
        assert min(ratios.values()) >= LEAST_CONTRAST, ratios
        page.locator("#theme").click()


@pytest.mark.parametrize("width", [320, 400, 760, 1000])
def test_the_page_never_scrolls_sideways(visit, width):
    page = visit(width=width).page
    for button in page.locator(".opens").all():
        button.click()
    assert page.evaluate("document.documentElement.scrollWidth") == width
    page.locator(".enlarge").first.click()
    assert page.evaluate("document.querySelector('dialog').scrollWidth") <= width


def test_paper_shows_names_and_the_details_of_what_is_worse(visit):
    page = visit(scheme="dark").page
    page.emulate_media(media="print")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert page.locator(".slices > tbody > tr > th:visible").count() == 10
    assert page.locator(".detail:visible").count() == 1
    assert page.locator("#theme:visible, .enlarge:visible, .filter:visible").count() == 0


def test_without_the_script_everything_can_be_read(browser, small):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(small.as_uri())
    assert page.locator(".detail:visible").count() == 10
    assert page.locator("button:visible").count() == 0


def test_a_year_of_a_hundred_slices_opens(visit, tmp_path, capsys):
    history = synthetic.history(tmp_path / "history", 365, 100)
    path = tmp_path / "report.html"
    write_page(history, None, path, synthetic.pictures(MOST_PICTURES))
    page = visit(path).page
    assert page.locator(".slices > tbody:visible").count() == 100
    loaded = page.evaluate("performance.getEntriesByType('navigation')[0].loadEventEnd")
    painted = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    with capsys.disabled():
        size = path.stat().st_size / 1e6
        print(f"\n365 nights x 100 slices: {size:.2f} MB, painted after {painted:.0f} ms, loaded after {loaded:.0f} ms")

"""A page as its elements, in the order of the file."""

from __future__ import annotations

from dataclasses import dataclass, field
from html.parser import HTMLParser

EMPTY = {"meta", "input", "br", "wbr", "rect", "circle", "path", "use", "image"}
CLOSED_BY = {"td": {"td", "th", "tr"}, "th": {"td", "th", "tr"}, "tr": {"tr"}}  # end tags that HTML lets us leave out


@dataclass
class Element:
    """One element; its parts are in `Page.all`, too."""

    tag: str
    attributes: dict[str, str]
    parents: tuple[Element, ...]
    words: list[str] = field(default_factory=list)

    @property
    def classes(self):
        return self.attributes.get("class", "").split()

    @property
    def text(self):
        """With the text of its parts."""
        return " ".join("".join(self.words).split())


class Page(HTMLParser):
    """The elements of a page, each with its text."""

    def __init__(self, text):
        super().__init__()
        self.all: list[Element] = []
        self._open: list[Element] = []
        self.feed(text)
        self.close()

    def of(self, tag, *classes):
        return [item for item in self.all if item.tag == tag and set(classes) <= set(item.classes)]

    def inside(self, outer, tag, *classes):
        return [item for item in self.of(tag, *classes) if any(parent is outer for parent in item.parents)]

    def handle_starttag(self, tag, attrs):
        table = max((i for i, item in enumerate(self._open) if item.tag == "table"), default=-1)
        while tag in CLOSED_BY and any(item.tag in CLOSED_BY[tag] for item in self._open[table + 1 :]):
            if tag in ("td", "th") and self._open[-1].tag == "tr":
                break
            self._open.pop()
        element = Element(tag, {name: value or "" for name, value in attrs}, tuple(self._open))
        self.all.append(element)
        if tag not in EMPTY:
            self._open.append(element)

    def handle_endtag(self, tag):
        if tag in EMPTY:
            return
        while self._open.pop().tag != tag:
            pass

    def handle_data(self, data):
        for item in self._open:
            item.words.append(data)

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


def assert_named_for_a_screen_reader(page):
    """Every section, figure, table and control has a name; what others refer to exists once."""
    ids = [item.attributes["id"] for item in page.all if "id" in item.attributes]
    assert len(ids) == len(set(ids))
    for item in page.all:
        for name in ("aria-labelledby", "aria-describedby"):
            assert item.attributes.get(name, ids[0]) in ids
        href = item.attributes.get("href", "#")
        beside = href.endswith(".html") and ":" not in href and not href.startswith("/")  # a page in the same folder
        assert href == "#" or href.startswith("data:") or href[1:] in ids or beside
    assert all("aria-labelledby" in item.attributes for item in page.of("section"))
    assert [len(page.of(tag)) for tag in ("header", "main", "footer", "h1")] == [1, 1, 1, 1]
    for item in page.of("svg"):
        hidden = item.attributes.get("aria-hidden") == "true"
        assert hidden != (item.attributes.get("role") == "img" and bool(item.attributes.get("aria-label")))
    captioned = [item.parents[-1] for item in page.of("caption")]
    assert all(any(table is other for other in captioned) for table in page.of("table"))
    assert all("scope" in item.attributes for item in page.of("th"))
    for item in page.of("input") + page.of("select"):
        assert any(parent.tag == "label" for parent in item.parents)

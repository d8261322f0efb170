"""What a page is made of: sections of tables and figures."""

from __future__ import annotations

from dataclasses import dataclass

from pipelines.pages.numbers import NONE, leading_number


@dataclass(frozen=True, slots=True)
class Table:
    """A table of texts."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""

    @property
    def numeric(self) -> tuple[bool, ...]:
        """Of each column, whether all its cells begin with a number, or hold none: then it is sorted by that."""
        columns = [[cell for cell in column if cell not in ("", NONE)] for column in zip(*self.rows, strict=True)]
        return tuple(bool(cells) and all(leading_number(cell) is not None for cell in cells) for cells in columns)

    def value(self, cell: str) -> str:
        """The number that a cell of a numeric column is sorted by, as a text; empty if it holds none."""
        number = leading_number(cell)
        return "" if number is None else f"{number:g}"


@dataclass(frozen=True, slots=True)
class Drawing:
    """A figure as one SVG text."""

    title: str
    svg: str
    note: str = ""


@dataclass(frozen=True, slots=True)
class Section:
    """What one part found."""

    title: str
    intro: str
    items: tuple[Table | Drawing, ...]

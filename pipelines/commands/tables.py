"""What commands print: tables that fit the terminal, with footnotes, and the same as JSON."""

from __future__ import annotations

import json
import re
import shutil
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import typer

GAP = 2  # spaces between columns
INDENT = 4  # of what stands under its heading, as in a list of keys
LEAST_WIDTH = 40  # a terminal that says it is narrower is not believed
MOST_LINES = 2  # of a cell; what needs more goes into a footnote


@dataclass(frozen=True, slots=True)
class Column:
    """A column's title and alignment. Numbers stand on the right and are never wrapped."""

    title: str
    number: bool = False


@dataclass(slots=True)
class Footnotes:
    """Texts that are too long for a cell, each numbered once."""

    texts: list[str] = field(default_factory=list)

    def mark(self, text: str) -> str:
        """`[2]` for a text, which is added if it is new; nothing for no text."""
        if not text:
            return ""
        if text not in self.texts:
            self.texts.append(text)
        return f"[{self.texts.index(text) + 1}]"

    def lines(self, width: int) -> Iterator[str]:
        """The texts behind their numbers, wrapped."""
        for number, text in enumerate(self.texts, start=1):
            mark = f"[{number}] "
            yield from textwrap.wrap(text, width, initial_indent=mark, subsequent_indent=" " * len(mark))


def terminal_width() -> int:
    """Columns of the terminal; 80 through a pipe."""
    return max(LEAST_WIDTH, shutil.get_terminal_size((80, 24)).columns)


def print_table(columns: Sequence[Column], rows: Iterable[Sequence[str]], footnotes: Footnotes | None = None) -> None:
    """Print a table. footnotes: those of other tables before it, which are added to and not printed."""
    width, notes = terminal_width(), Footnotes() if footnotes is None else footnotes
    for line in table_lines(columns, list(rows), width, notes):
        typer.echo(line)
    if footnotes is None:
        print_footnotes(notes)


def print_footnotes(notes: Footnotes) -> None:
    """Print footnotes below what they belong to."""
    if notes.texts:
        typer.echo()
    for line in notes.lines(terminal_width()):
        typer.echo(line)


def print_keys(rows: Iterable[tuple[str, str, str]]) -> None:
    """Print keys with their values side by side, and the meaning of each, if it has one, on the lines below it."""
    entries, width, notes = list(rows), terminal_width(), Footnotes()
    column = max(len(key) for key, _, _ in entries) + GAP
    for key, value, meaning in entries:
        first, *rest = _cell_lines(value, width - column, notes, f"{key} = ")
        typer.echo(f"{key:<{column}}{first}".rstrip())
        for line in rest:
            typer.echo(f"{' ' * column}{line}")
        for line in _cell_lines(meaning, width - INDENT, notes, f"{key}: ") if meaning else ():
            typer.echo(f"{' ' * INDENT}{line}")
    print_footnotes(notes)


def print_json(value: object) -> None:
    """Print a value as JSON.

    Raises:
        ValueError: a number in it is not finite.
    """
    typer.echo(json.dumps(value, indent=2, allow_nan=False))


def table_lines(columns: Sequence[Column], rows: Sequence[Sequence[str]], width: int, notes: Footnotes) -> list[str]:
    """Lines of a table, none longer than `width`. The widest column of text takes the room that the others leave."""
    widths = _widths(columns, rows, width)
    lines = [_line(columns, widths, [column.title for column in columns])]
    for row in rows:
        cells = [
            [cell] if column.number else _cell_lines(cell, size, notes)
            for column, size, cell in zip(columns, widths, row, strict=True)
        ]
        for i in range(max(map(len, cells))):
            lines.append(_line(columns, widths, [cell[i] if i < len(cell) else "" for cell in cells]))
    return lines


def _widths(columns: Sequence[Column], rows: Sequence[Sequence[str]], width: int) -> list[int]:
    widths = [max(len(text) for text in texts) for texts in zip([c.title for c in columns], *rows, strict=True)]
    widest = max((i for i, column in enumerate(columns) if not column.number), key=lambda i: widths[i])
    rest = sum(widths) - widths[widest] + GAP * (len(widths) - 1)
    widths[widest] = min(widths[widest], max(1, width - rest))
    return widths


def _line(columns: Sequence[Column], widths: Sequence[int], cells: Sequence[str]) -> str:
    aligned = (
        f"{cell:>{size}}" if column.number else f"{cell:<{size}}"
        for column, size, cell in zip(columns, widths, cells, strict=True)
    )
    return (" " * GAP).join(aligned).rstrip()


def _cell_lines(text: str, width: int, notes: Footnotes, name: str = "") -> list[str]:
    """A cell's text, wrapped; one that is too long is cut, at a clause if it has one, and a footnote has the whole.

    Spaces at its start indent all of its lines. name: stands before the text in the footnote.
    """
    indent = " " * (len(text) - len(text.lstrip()))
    lines = textwrap.wrap(text, width, subsequent_indent=indent)
    if len(lines) <= MOST_LINES:
        return lines or [""]
    mark = notes.mark(name + text.strip())
    quoted = text.lstrip().startswith(('"', "["))  # a value, which has no clauses
    clause = text.strip() if quoted else re.split("[:;] ", text.strip())[0]
    room = width - len(indent) - len(mark) - 1
    kept = textwrap.shorten(clause, room, placeholder=" ...") or clause[:room]
    return [f"{indent}{kept} {mark}"]

"""The one table of all measurements, for the terminal and as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rich.table import Table

from pipelines.bench.timing import Times

TITLES = ("part", "ours", "ours, ms", "compared with", "that, ms", "ratio", "ratio of CPU time")


@dataclass(frozen=True, slots=True)
class Row:
    """One measurement; ratios say how many of ours fit into one of the other."""

    part: str
    ours: str
    ours_ms: str
    other: str
    other_ms: str
    ratio: str
    cpu_ratio: str

    def cells(self) -> tuple[str, ...]:
        """The cells in the order of TITLES."""
        return self.part, self.ours, self.ours_ms, self.other, self.other_ms, self.ratio, self.cpu_ratio


def compared(part: str, ours: str, own: Times, other: str, that: Times, count: int = 1) -> Row:
    """A comparison of two times, both shown per one of `count`."""
    wall, cpu = that.wall / own.wall, that.cpu / max(own.cpu, 1e-9)
    return Row(part, ours, _ms(own, count), other, _ms(that, count), f"{wall:.3g}", f"{cpu:.3g}")


def noted(part: str, ours: str, figure: str, other: str = "", value: str = "") -> Row:
    """A figure that is no comparison of two times; `value` stands in the column of ratios."""
    return Row(part, ours, figure, other, "", value, "")


def terminal(rows: Iterable[Row], title: str) -> Table:
    """The table for Rich."""
    table = Table(box=None, title=title, title_justify="left")
    for name in TITLES:
        table.add_column(name, justify="left" if name in ("part", "ours", "compared with") else "right")
    for row in rows:
        table.add_row(*row.cells())
    return table


def markdown(rows: Sequence[Row], facts: Iterable[tuple[str, str]]) -> str:
    """The table and the machine as Markdown."""
    lines = ["# Measured speed", "", "Ratio: how many of ours fit into one of what it is compared with.", ""]
    lines += [f"- {name}: {value}" for name, value in facts]
    lines += ["", f"| {' | '.join(TITLES)} |", "|---|---|--:|---|--:|--:|--:|"]
    lines += [f"| {' | '.join(row.cells())} |" for row in rows]
    return "\n".join(lines) + "\n"


def _ms(times: Times, count: int) -> str:
    return f"{1e3 * times.wall / count:.3g}"

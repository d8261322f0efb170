"""What was measured, as data and as Markdown: comparisons of two times, and single figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from pipelines.timing import Times

TITLES = ("part", "ours", "ours, ms", "compared with", "that, ms", "ratio", "ratio of CPU time")


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two times, measured in turn; ratios say how many of ours fit into one of the other."""

    part: str
    ours: str
    ours_ms: float
    other: str
    other_ms: float
    ratio: float
    cpu_ratio: float

    def cells(self) -> tuple[str, ...]:
        """The cells in the order of TITLES."""
        return (
            self.part, self.ours, short(self.ours_ms), self.other, short(self.other_ms), short(self.ratio),
            short(self.cpu_ratio),
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure that is no comparison of two times, with the other's figure or what follows from it, if there is one."""

    part: str
    ours: str
    figure: str
    other: str = ""
    value: str = ""

    def cells(self) -> tuple[str, ...]:
        """The cells in the order of TITLES: `value` stands in the column of ratios."""
        return self.part, self.ours, self.figure, self.other, "", self.value, ""


Row = Comparison | Figure


def compared(part: str, ours: str, own: Times, other: str, that: Times, count: int = 1) -> Comparison:
    """A comparison of two times, both shown per one of `count`."""
    own_ms, that_ms = (1e3 * times.wall / count for times in (own, that))
    return Comparison(part, ours, own_ms, other, that_ms, that.wall / own.wall, that.cpu / max(own.cpu, 1e-9))


def short(number: float) -> str:
    """Three significant digits, and all digits of what is larger."""
    return f"{number:.0f}" if abs(number) >= 1000.0 else f"{number:.3g}"


def markdown(rows: Sequence[Row], facts: Iterable[tuple[str, str]]) -> str:
    """The table and the machine as Markdown."""
    lines = ["# Measured speed", "", "Ratio: how many of ours fit into one of what it is compared with.", ""]
    lines += [f"- {name}: {value}" for name, value in facts]
    lines += ["", f"| {' | '.join(TITLES)} |", "|---|---|--:|---|--:|--:|--:|"]
    lines += [f"| {' | '.join(row.cells())} |" for row in rows]
    return "\n".join(lines) + "\n"

"""Small drawings as the inside of an SVG element: numbers only, so that no name from the data gets into them.

Lines over the nights have one unit along x for each night, and are stretched to the page's width; strokes are not.
Paths go in whole units and in steps, which keeps a year of nights under two kilobytes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.nightly.page.findings import Row
from pipelines.nightly.page.series import Series

INTERVAL_WIDTH, INTERVAL_HEIGHT = 320, 36
SPARK_HEIGHT, TREND_HEIGHT = 60, 400
FILLED = 0.9  # part of a drawing's height, or half width, that the largest number reaches


def interval(row: Row) -> str:
    """The effect with its interval on an axis around zero; a band for the margin, ticks for the smallest visible."""
    ends = [abs(value) for value in (row.low, row.high, row.effect, row.margin, row.smallest_visible)]
    reach = max([value for value in ends if np.isfinite(value)], default=1.0) or 1.0
    middle = INTERVAL_WIDTH / 2

    def x(value: float) -> float:
        return round(middle + FILLED * middle * (value if np.isfinite(value) else 0.0) / reach, 1)

    h, half = INTERVAL_HEIGHT, INTERVAL_HEIGHT / 2
    band = f'<rect class="band" x="{x(-row.margin)}" width="{x(row.margin) - x(-row.margin):.1f}" height="{h}"/>'
    seen = "".join(f"M{x(side * row.smallest_visible)} 0v{h}" for side in (-1, 1))
    whisker = f"M{x(row.low)} {half}H{x(row.high)}M{x(row.low)} {half - 6}v12M{x(row.high)} {half - 6}v12"
    return (
        f'{band}<path class="zero" d="M{middle} 0v{h}"/><path class="seen" d="{seen}"/>'
        f'<path class="whisker" d="{whisker}"/><circle cx="{x(row.effect)}" cy="{half}" r="5"/>'
    )


def spark(item: Series) -> str:
    """The candidate's values over the nights; noise inside the margin stays small."""
    lowest, highest = _range([item.new], float(np.nanmedian(item.new)), _margin(item))
    y = _heights(item.new, lowest, highest, SPARK_HEIGHT)
    return f'<path d="{_line(y)}"/><path class="end" d="{_dots(y, _last(item.new))}"/>'


@dataclass(frozen=True, slots=True)
class Trend:
    """A line over the nights and what its axis spans."""

    inside: str
    lowest: float
    highest: float


def trend(item: Series, moved: list[int]) -> Trend:
    """The candidate's values with their interval, the baseline's margins, and the nights that were worse.

    moved: nights at which the baseline became another.
    """
    low, high, margin = item.old + item.low, item.old + item.high, _margin(item)
    lowest, highest = _range([item.new, low, high], float(item.old[_last(item.old)][0]), margin)
    y = _heights(item.new, lowest, highest, TREND_HEIGHT)
    bands = [
        _between(*(_heights(side, lowest, highest, TREND_HEIGHT) for side in sides))
        for sides in ((item.old - margin, item.old + margin), (low, high))
    ]
    bars = "".join(f"M{night - 0.5} 0V{TREND_HEIGHT}" for night in moved)
    inside = (
        f'<path class="band" d="{bands[0]}"/><path class="spread" d="{bands[1]}"/><path class="moved" d="{bars}"/>'
        f'<path class="line" d="{_line(y)}"/><path class="end" d="{_dots(y, _last(item.new))}"/>'
        f'<path class="worse" d="{_dots(y, item.worse)}"/>'
    )
    return Trend(inside, lowest, highest)


def _margin(item: Series) -> float:
    return float(item.margin[_last(item.margin)][0])


def _last(values: Array) -> Mask:
    """(n,) the last night that has a value."""
    known = np.isfinite(values)
    return known & (np.cumsum(known) == np.sum(known))


def _range(values: list[Array], middle: float, margin: float) -> tuple[float, float]:
    """What an axis spans: all values, and never less than two margins around the middle."""
    joined = np.concatenate([*values, [middle - 2.0 * margin, middle + 2.0 * margin]])
    return float(np.nanmin(joined)), float(np.nanmax(joined))


def _heights(values: Array, lowest: float, highest: float, height: int) -> Array:
    """(n,) whole units from the top; NaN where there is no value."""
    part = np.clip((values - lowest) / ((highest - lowest) or 1.0), 0.0, 1.0)
    return np.round(height * (0.5 + FILLED * (0.5 - part)))


def _line(y: Array) -> str:
    """A path through the nights that have a value; it breaks where one has none."""
    parts: list[str] = []
    before = np.nan
    for night, value in enumerate(y.tolist()):
        step = value - before
        if np.isfinite(step):
            parts.append(f" 1{'' if step < 0.0 else ' '}{step:.0f}")
        elif np.isfinite(value):
            parts.append(f"M{night} {value:.0f}l0 0")
        before = value
    return "".join(parts)


def _between(low: Array, high: Array) -> str:
    """Closed areas between two lines, one for each stretch of nights."""
    known = np.flatnonzero(np.isfinite(low) & np.isfinite(high))
    found: list[str] = []
    for nights in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1) if len(known) else ():
        there = _steps(nights, high, 0.5)
        back = _steps(nights[::-1], low, -0.5)
        found.append(f"M{there}L{back}z")
    return "".join(found)


def _steps(nights: NDArray[np.intp], y: Array, side: float) -> str:
    """Corners of a step function: a night's value holds from half a night before to half a night after.

    side: half a night in the direction of `nights`.
    """
    values = y[nights].tolist()
    return " ".join(
        f"{night - side:g} {value:.0f} {night + side:g} {value:.0f}"
        for i, (night, value) in enumerate(zip(nights.tolist(), values, strict=True))
        if i in (0, len(values) - 1) or value != values[i - 1] or value != values[i + 1]
    )


def _dots(y: Array, chosen: Mask) -> str:
    """Points as strokes of no length, whose round ends stay round when the drawing is stretched."""
    return "".join(f"M{night} {y[night]:.0f}h0" for night in np.flatnonzero(chosen & np.isfinite(y)).tolist())

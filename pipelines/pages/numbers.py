"""Numbers as a page shows them: no digit that means nothing."""

from __future__ import annotations

import re

import numpy as np

from pipelines.statistics import Interval

NONE = "\N{EN DASH}"
LEADING_NUMBER = re.compile(r"[+\-\u2212]?\d+(\.\d+)?(e[+-]?\d+)?")


def sensible(value: float | None, digits: int = 2) -> str:
    """To significant digits, without zeros at their end; a dash for none."""
    if value is None or not np.isfinite(value):
        return NONE
    return f"{value:.0f}" if 10.0**digits <= abs(value) < 1e6 else f"{value:.{digits}g}"


def two_digits(value: float) -> str:
    """To two or three significant digits with zeros at their end, so that a column reads as one; a dash for none."""
    return rounded(value, 0.2 * abs(value))


def rounded(value: float, step: float, signed: bool = False) -> str:
    """To the first digit of `step`, to the second if the first is a 1; a dash for none."""
    if not np.isfinite(value):
        return NONE
    if abs(value) >= 1e6 or 0.0 < abs(value) < 1e-6:
        return f"{value:{'+' if signed else ''}.1e}"
    known = np.isfinite(step) and step > 0.0
    text = f"{value:+.{int(np.clip(np.ceil(-np.log10(step / 2.0)), 0, 9)) if known else 0}f}"
    return text[1:] if float(text) == 0.0 or (text[0] == "+" and not signed) else text


def with_interval(found: Interval | None, signed: bool = False) -> str:
    """`1.23 [1.20, 1.27]`, to the digits that the interval supports; a dash for none.

    At most two digits of the value, and exactly two where it is no signed one, whose size is its meaning.
    """
    if found is None or not np.isfinite(found.value):
        return NONE
    if not np.isfinite(found.high - found.low):
        return sensible(found.value)
    most = abs(found.value) / 10.0
    step = max(found.high - found.low, most) if signed else 2.0 * most
    value, low, high = (rounded(item, step, signed) for item in (found.value, found.low, found.high))
    return f"{value} [{low}, {high}]"


def share(found: Interval) -> str:
    """A share with its interval: `97.5 [93, 99.2] %`."""
    value, low, high = (f"{100.0 * item:.3g}" for item in (found.value, found.low, found.high))
    return f"{value} [{low}, {high}] %"


def leading_number(text: str) -> float | None:
    """The number that a text begins with, by which a column is sorted."""
    found = LEADING_NUMBER.match(text)
    return float(found[0].replace("\u2212", "-")) if found else None

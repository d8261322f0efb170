"""Drawings: their places are the numbers', and a missing night is a gap."""

import re

import numpy as np
import pytest

from pipelines.nightly.page import plots
from pipelines.nightly.page.series import Series
from tests.pipelines.nightly.page.test_findings import ROW


def _series(new, worse=(), margin=1.0):
    new = np.array(new, float)
    old = np.where(np.isfinite(new), 0.0, np.nan)
    flags = np.isin(np.arange(len(new)), worse)
    return Series(old, new, new - 0.5, new + 0.5, np.where(np.isfinite(new), margin, np.nan), flags)


def _points(path):
    """Corners of a path of absolute moves and relative lines."""
    found = []
    for part in filter(None, path.split("M")):
        start, _, steps = part.partition("l")
        x, y = map(float, start.split())
        numbers = [float(value) for value in re.findall(r"-?\d+", steps)]
        for dx, dy in zip(numbers[::2], numbers[1::2], strict=True):
            x, y = x + dx, y + dy
            found.append((x, y))
    return found


def _path(inside, name):
    return re.search(f'class="{name}" d="([^"]*)"', inside)[1]


def test_a_trend_goes_through_its_values_and_breaks_at_gaps():
    values = [0.0, 1.0, -2.0, np.nan, 3.0, 3.0, np.nan]
    found = plots.trend(_series(values, worse=[4]), moved=[2])
    line = _path(found.inside, "line")
    points = _points(line)
    assert [night for night, _ in points] == [0, 1, 2, 4, 5]
    assert line.count("M") == 2
    scale = plots.FILLED * plots.TREND_HEIGHT / (found.highest - found.lowest)
    for night, y in points:
        from_top = 0.05 * plots.TREND_HEIGHT + (found.highest - values[int(night)]) * scale
        assert y == pytest.approx(from_top, abs=0.5)  # drawn in whole units
    assert _path(found.inside, "end").startswith("M5 ")
    assert _path(found.inside, "worse").startswith("M4 ")
    assert _path(found.inside, "moved") == f"M1.5 0V{plots.TREND_HEIGHT}"
    assert (found.lowest, found.highest) == (-2.5, 3.5)


def test_noise_inside_the_margin_looks_small():
    rng = np.random.default_rng(0)
    heights = [y for _, y in _points(re.search('d="([^"]*)"', plots.spark(_series(rng.normal(0.0, 0.05, 50))))[1])]
    assert max(heights) - min(heights) < 0.1 * plots.SPARK_HEIGHT  # of four margins, as 0.2 is of 4, and rounding


def test_an_interval_is_where_its_numbers_are():
    inside = plots.interval(ROW)
    middle = plots.INTERVAL_WIDTH / 2
    per_px = plots.FILLED * middle / ROW.high  # the largest number
    band = re.search(r'class="band" x="([\d.]+)" width="([\d.]+)"', inside)
    assert float(band[1]) == pytest.approx(middle - per_px * ROW.margin, abs=0.1)
    assert float(band[2]) == pytest.approx(2 * per_px * ROW.margin, abs=0.2)
    assert float(re.search(r'cx="([\d.]+)"', inside)[1]) == pytest.approx(middle + per_px * ROW.effect, abs=0.1)
    low, high = re.match(r"M([\d.]+) 18.0H([\d.]+)", _path(inside, "whisker")).groups()
    assert [float(low), float(high)] == pytest.approx([middle + per_px * v for v in (ROW.low, ROW.high)], abs=0.1)


def test_bands_reach_half_a_night_to_both_sides():
    """Around a lone night, and around a stretch with a step."""
    found = plots.trend(_series([np.nan, 1.0, np.nan, 2.0, 2.0, 3.0]), [])
    scale = plots.FILLED * plots.TREND_HEIGHT / (found.highest - found.lowest)
    areas = _path(found.inside, "spread").rstrip("z").split("zM")
    ends = [(1.0, 1.0, 0.5, 1.5), (2.0, 3.0, 2.5, 5.5)]
    for area, (first, last, left, right) in zip(areas, ends, strict=True):
        corners = [np.array(part.split(), float).reshape(-1, 2) for part in area.removeprefix("M").split("L")]
        for side, order in zip(corners, (1, -1), strict=True):  # the upper end there, the lower one back
            from_left = side[::order]
            assert from_left[[0, -1], 0].tolist() == [left, right]
            assert np.all(np.diff(from_left[:, 0]) >= 0.0)
            ends_at = [found.highest - value - 0.5 * order for value in (first, last)]
            assert from_left[[0, -1], 1] == pytest.approx(
                [0.05 * plots.TREND_HEIGHT + e * scale for e in ends_at], abs=0.5
            )


def test_one_night_and_equal_values_are_drawn():
    for values in ([1.0], [1.0, 1.0], [np.nan, 1.0]):
        assert "nan" not in plots.trend(_series(values), []).inside + plots.spark(_series(values))

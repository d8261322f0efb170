"""Figures of the report, each as one SVG text."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cbook import boxplot_stats
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.pages.svg import STYLE, svg
from pipelines.report.data import ERRORS, Series

MOST_DRAWN = 5000  # rows of a setting as points of its curves
MOST_OUTLIERS = 200  # of one box, half of them at either end
BOXES = ("rx_error_deg", "ry_error_deg", "rz_error_deg", "tx_error_mm", "ty_error_mm", "tz_error_mm")


def along_helix(item: Series, frames: dict[int, dict[str, Any]]) -> str:
    """Rotation and depth error against time, one line for each camera; of more than `MOST_DRAWN` rows a spread."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 2, figsize=(10, 3), layout="constrained")
        cameras = dict.fromkeys(frames[int(i)]["camera_name"] for i in item.frame_id)
        for name in cameras:
            own = np.flatnonzero([frames[int(i)]["camera_name"] == name for i in item.frame_id])
            drawn = _spread(own, MOST_DRAWN // len(cameras))
            time = np.array([frames[int(i)]["time_s"] for i in item.frame_id[drawn]])
            for axis, column in zip(axes, ("rotation_error_deg", "tz_error_mm"), strict=True):
                axis.plot(time, item.errors[column][drawn], ".-", linewidth=1, markersize=4, label=name)
                axis.set(xlabel="t, s", ylabel=ERRORS[column])
        axes[1].axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
        axes[0].legend(fontsize=7, frameon=False)
        return svg(figure)


def boxes(item: Series, frames: dict[int, dict[str, Any]]) -> str:
    """Box plots of the six components, one box for each camera; of many outliers the largest are drawn."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 6, figsize=(11, 2.4), layout="constrained", sharey=True)
        camera = np.array([frames[int(i)]["camera_name"] for i in item.frame_id])
        names = list(dict.fromkeys(camera.tolist()))
        for axis, column in zip(axes, BOXES, strict=True):
            values = [item.errors[column][(camera == name) & ~item.failed] for name in names]
            axis.bxp(
                [_box(own) for own in values],
                orientation="horizontal",
                manage_ticks=False,
                flierprops={"markersize": 2},
                widths=0.6,
            )
            axis.axvline(0.0, color="0.8", linewidth=0.8, zorder=0)
            axis.set_title(ERRORS[column], fontsize=9)
            axis.locator_params(axis="x", nbins=3)
        axes[0].set_yticks(range(1, len(names) + 1), names)
        axes[0].set_ylim(len(names) + 0.5, 0.5)  # the first camera above
        return svg(figure)


def _spread(rows: NDArray[np.intp], most: int) -> NDArray[np.intp]:
    """Rows, or so many of them at equal distances, with the first and the last."""
    return rows if len(rows) <= most else rows[np.linspace(0, len(rows) - 1, most).round().astype(int)]


def _box(values: Array) -> dict[str, Any]:
    """What a box shows of all values, with the outermost outliers only."""
    (found,) = boxplot_stats(values)
    outliers = np.sort(found["fliers"])
    half = MOST_OUTLIERS // 2
    if len(outliers) > MOST_OUTLIERS:
        found["fliers"] = np.concatenate((outliers[:half], outliers[-half:]))
    return found

"""Figures of the report, each as one SVG text."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from pipelines.pages.svg import STYLE, svg
from pipelines.report.data import ERRORS, Series

BOXES = ("rx_error_deg", "ry_error_deg", "rz_error_deg", "tx_error_mm", "ty_error_mm", "tz_error_mm")


def along_helix(item: Series, frames: dict[int, dict[str, Any]]) -> str:
    """Rotation and depth error against time, one line for each camera."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 2, figsize=(10, 3), layout="constrained")
        cameras = dict.fromkeys(frames[int(i)]["camera_name"] for i in item.frame_id)
        for name in cameras:
            mask = np.array([frames[int(i)]["camera_name"] == name for i in item.frame_id])
            time = np.array([frames[int(i)]["time_s"] for i in item.frame_id[mask]])
            for axis, column in zip(axes, ("rotation_error_deg", "tz_error_mm"), strict=True):
                axis.plot(time, item.errors[column][mask], ".-", linewidth=1, markersize=4, label=name)
                axis.set(xlabel="t, s", ylabel=ERRORS[column])
        axes[1].axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
        axes[0].legend(fontsize=7, frameon=False)
        return svg(figure)


def boxes(item: Series, frames: dict[int, dict[str, Any]]) -> str:
    """Box plots of the six components, one box for each camera."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 6, figsize=(11, 2.4), layout="constrained", sharey=True)
        camera = np.array([frames[int(i)]["camera_name"] for i in item.frame_id])
        names = list(dict.fromkeys(camera.tolist()))
        for axis, column in zip(axes, BOXES, strict=True):
            values = [item.errors[column][(camera == name) & ~item.failed] for name in names]
            axis.boxplot(values, orientation="horizontal", manage_ticks=False, flierprops={"markersize": 2}, widths=0.6)
            axis.axvline(0.0, color="0.8", linewidth=0.8, zorder=0)
            axis.set_title(ERRORS[column], fontsize=9)
            axis.locator_params(axis="x", nbins=3)
        axes[0].set_yticks(range(1, len(names) + 1), names)
        axes[0].set_ylim(len(names) + 0.5, 0.5)  # the first camera above
        return svg(figure)

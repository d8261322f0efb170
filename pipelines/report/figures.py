"""Figures of the report, each as one SVG text."""

from __future__ import annotations

import base64
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from datasets.store.images import encode_png
from eposit.arrays import Array
from pipelines.report.data import ERRORS, Series
from pipelines.report.svg import STYLE, svg
from render.targets.image_region import Region

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
        figure, axes = plt.subplots(1, 6, figsize=(11, 2.8), layout="constrained")
        camera = np.array([frames[int(i)]["camera_name"] for i in item.frame_id])
        names = list(dict.fromkeys(camera.tolist()))
        for axis, column in zip(axes, BOXES, strict=True):
            values = [item.errors[column][(camera == name) & ~item.failed] for name in names]
            axis.boxplot(values, tick_labels=[name[:5] for name in names], flierprops={"markersize": 2}, widths=0.6)
            axis.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
            axis.set_title(ERRORS[column], fontsize=9)
            axis.tick_params(axis="x", rotation=60)
        return svg(figure)


def picture(image: Any, region: Region, points: Array, width: int = 300) -> str:
    """The region of an image with its detected points drawn on it, as SVG with the PNG inside."""
    data = base64.b64encode(encode_png(np.ascontiguousarray(image[region.pixels]))).decode()
    size = 0.006 * max(region.width, region.height)
    marks: list[str] = []
    for i, (u, v) in enumerate(points):
        if not np.isfinite(u):
            continue
        # Pixel centres are at integers, an SVG picture's pixel i covers [i, i + 1).
        px, py = u - region.x + 0.5, v - region.y + 0.5
        colour = "#e8590c" if i == len(points) - 1 else "#1c7ed6" if i else "#2f9e44"
        marks.append(
            f'<path d="M{px - size:.2f} {py:.2f}h{2 * size:.2f}M{px:.2f} {py - size:.2f}v{2 * size:.2f}" '
            f'stroke="{colour}" stroke-width="{size / 3:.2f}"/>'
        )
    return (
        f'<svg viewBox="0 0 {region.width} {region.height}" width="{width}" xmlns="http://www.w3.org/2000/svg">'
        f'<image href="data:image/png;base64,{data}" width="{region.width}" height="{region.height}"/>'
        f"{''.join(marks)}</svg>"
    )

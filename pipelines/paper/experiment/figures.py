"""Figures of the experiment: the paper's 8, 9 and 7 (b), with the truth and its numbers in them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from eposit.arrays import Array
from eposit.pose import euler_from_rotation
from pipelines.pages.svg import STYLE, svg
from pipelines.paper.experiment.pictures import HARD, MethodResult, Pictures

MARKS = ("o", "x", "+", "s")
LIMIT_RAD, LIMITS_MM = 0.2, (50.0, 50.0, 200.0)  # the paper's
PAPER_PX = 1.4


def poses_figure(pictures: Pictures, results: Sequence[MethodResult]) -> str:
    """Angles and translations of every picture, with the truth as a line."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(3, 2, figsize=(11, 7), layout="constrained", sharex=True)
        number = _numbers(pictures)
        for i, axis in enumerate("xyz"):
            for column, values in enumerate((_angles(pictures.cam_from_obj.R), pictures.cam_from_obj.t)):
                axes[i, column].plot(number, values[:, i], "-", color="0.6", linewidth=1, label="truth")
            for result, mark in zip(results, MARKS, strict=False):
                for column, values in enumerate((_angles(result.cam_from_obj.R), result.cam_from_obj.t)):
                    axes[i, column].plot(number, values[:, i], mark, markersize=5, fillstyle="none", label=result.name)
            axes[i, 0].set_ylabel(f"r{axis}, rad")
            axes[i, 1].set_ylabel(f"{axis}, mm")
        return _finished(figure, axes)


def differences_figure(pictures: Pictures, result: MethodResult, calibration: MethodResult) -> str:
    """Differences of a method from the calibration, and the errors of both, with the paper's limits."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(3, 2, figsize=(11, 7), layout="constrained", sharex=True)
        number, truth = _numbers(pictures), pictures.cam_from_obj
        shown = (
            (f"{result.name} - calibration", result, calibration.cam_from_obj),
            (f"{result.name} - truth", result, truth),
            ("calibration - truth", calibration, truth),
        )
        for i, axis in enumerate("xyz"):
            for (label, item, other), mark in zip(shown, MARKS, strict=False):
                for column, values in enumerate((item.rotation_rad(other), item.shift_mm(other))):
                    axes[i, column].plot(number, values[:, i], mark, markersize=5, fillstyle="none", label=label)
                axes[i, 0].set_ylabel(f"r{axis}, rad")
            axes[i, 1].set_ylabel(f"{axis}, mm")
            for column, limit in enumerate((LIMIT_RAD, LIMITS_MM[i])):
                for sign in (-1.0, 1.0):
                    axes[i, column].axhline(sign * limit, color="0.4", linestyle="--", linewidth=0.8)
        return _finished(figure, axes)


def reprojection_figure(pictures: Pictures, results: Sequence[MethodResult]) -> str:
    """Reprojection errors of every picture over the points used, logarithmic, with the paper's mean."""
    with plt.rc_context(STYLE):
        figure, axis = plt.subplots(figsize=(9, 3.4), layout="constrained")
        for result, mark in zip(results, MARKS, strict=False):
            axis.plot(_numbers(pictures), result.used_px, mark, markersize=5, fillstyle="none", label=result.name)
        axis.axhline(PAPER_PX, color="0.4", linestyle="--", linewidth=0.8, label="the paper's mean of EPOSIT")
        axis.set(yscale="log", ylabel="reprojection, px RMS")
        return _finished(figure, np.array([[axis]]))


def _finished(figure: Figure, axes: Any) -> str:
    for axis in axes.ravel():
        _mark_hard(axis)
    for axis in axes[-1]:
        axis.set_xlabel("picture")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), fontsize=8, frameon=False)
    return svg(figure)


def _mark_hard(axis: Axes) -> None:
    for number in HARD:
        axis.axvspan(number - 0.4, number + 0.4, color="#ffe8cc", zorder=0, linewidth=0)


def _numbers(pictures: Pictures) -> Array:
    return np.arange(1, len(pictures.points_px) + 1, dtype=np.float64)


def _angles(R: Array) -> Array:
    """(b, 3) rad, NaN for NaN rotations."""
    angles = np.full((len(R), 3), np.nan)
    there = np.all(np.isfinite(R), axis=(1, 2))
    angles[there] = euler_from_rotation(R[there])
    return angles

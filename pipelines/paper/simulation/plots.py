"""Figures of the simulation, drawn as the paper's are."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from eposit.arrays import Array
from pipelines.pages.svg import STYLE, svg
from pipelines.paper.simulation import COMPONENTS, UNITS


def curves(time: Array, truth: Array, series: dict[str, Array]) -> str:
    """The six components over time. truth: (t, 6). series: name to (t, 6)."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 3, figsize=(11, 5), layout="constrained")
        for k, axis in enumerate(axes.ravel()):
            for name, values in series.items():
                axis.plot(time, values[:, k], linewidth=0.6, label=name)
            axis.plot(time, truth[:, k], "k--", linewidth=1.0, label="truth")
            axis.set(xlabel="t, s", ylabel=f"{COMPONENTS[k]}, {UNITS[k]}")
        axes[0, 0].legend(fontsize=7, frameon=False)
        return svg(figure)


def boxes(series: dict[str, Array], lines: dict[int, list[float]], limits: bool = False) -> str:
    """One box for each series in each of six components.

    series: name to (m, 6) errors, NaN left out. lines: component to numbers that the paper states, drawn dashed.
    limits: cut the axes at the 99th percentile of all series' magnitudes but for the worst ones.
    """
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 3, figsize=(11, 5.5), layout="constrained")
        for k, axis in enumerate(axes.ravel()):
            values = [part[np.isfinite(part[:, k]), k] for part in series.values()]
            axis.boxplot(values, tick_labels=list(series), flierprops={"markersize": 1.5}, widths=0.6)
            axis.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
            for number in lines.get(k, []):
                axis.axhline(number, color="tab:red", linestyle="--", linewidth=0.9)
            if limits:
                reach = max(float(np.median([np.percentile(np.abs(part), 99.0) for part in values if len(part)])), 1e-6)
                axis.set_ylim(-1.5 * reach, 1.5 * reach)
            axis.set_ylabel(f"{COMPONENTS[k]}, {UNITS[k]}")
            axis.tick_params(axis="x", rotation=45, labelsize=7)
        return svg(figure)

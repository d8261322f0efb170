"""How near errors come to the least that noise allows: for each component, and for more points."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

import eposit
from eposit.arrays import Array
from pipelines.pages.sections import Drawing, Table
from pipelines.pages.svg import STYLE, svg
from pipelines.paper.claims import PaperSection, Statement, holds_if
from pipelines.paper.problems import (
    NORMAL_MEDIAN,
    OBJECT,
    SIGMA_PX,
    bounds,
    camera_with,
    cloud,
    errors_of,
    helix,
    information,
    noisy,
    repeated,
)
from pipelines.statistics import Interval, bootstrap, median

COMPONENTS = ("rotation x", "rotation y", "rotation z", "x", "y", "z")
CAMERAS = {"perspective": "pinhole", "orthogonal": "orthogonal fish-eye"}
METHODS = {"eposit": "EPOSIT", "best": "default"}
COUNTS = (4, 6, 8, 12, 20, 55)
RESAMPLES = 300
TICKS = tuple(digit * 10.0**power for power in range(-2, 3) for digit in (1, 2, 5))


def bound(draws: int = 20, seed: int = 3) -> PaperSection:
    """Median absolute error over its bound, for each component, camera and method."""
    rows: list[tuple[str, ...]] = []
    for lens, camera in CAMERAS.items():
        for method, name in METHODS.items():
            ratios = _over_bound(lens, method, draws, seed)
            rows.append((camera, name, *(_median_text(ratios[..., i]) for i in range(6))))
    head = ("camera", "solver", *COMPONENTS)
    table = Table(
        "Median absolute error over the Cramer-Rao bound's",
        head,
        tuple(rows),
        "1 is the least that an unbiased solver reaches. 95 % bootstrap intervals over the frames of the helix.",
    )
    intro = (
        f"The paper's simulation with {draws} draws of {SIGMA_PX:g} px noise a frame, exact camera. Each error is "
        "divided by its own frame's bound times 0.6745, the median of a normal deviation. EPOSIT solves for I and J "
        "freely and drops that they are as long as each other and perpendicular; refinement keeps both."
    )
    return PaperSection("The bound", intro, (table,))


def more_points(draws: int = 4, step: float = 1.0, seed: int = 4) -> PaperSection:
    """RMS error of EPOSIT and of the default against the number of points, beside the bound."""
    found = {lens: _rms_errors(lens, draws, step, seed) for lens in CAMERAS}
    head = ("camera", "points", *(f"{name}: {what}" for what in ("rotation, deg", "position, mm") for name in _NAMES))
    rows = tuple(
        (CAMERAS[lens], str(n), *(f"{values[i, j, k]:.3g}" for k in (0, 1) for j in range(3)))
        for lens, values in found.items()
        for i, n in enumerate(COUNTS)
    )
    intro = (
        "The paper's four points, then more at random places in the cube of 200 mm that they span, on the paper's "
        f"helix with noise of {SIGMA_PX:g} px. EPOSIT takes more points by least squares on its linear equations."
    )
    table = Table("RMS error against the number of points", head, rows, "RMS of the whole rotation and position.")
    drawing = Drawing("Error against the number of points", _lines(found))
    return PaperSection("More points", intro, (drawing, table), (STATEMENT.judged(found),))


def _rms_text(found: dict[str, Array]) -> str:
    four, many = found["orthogonal"][0], found["orthogonal"][-1]
    rotation, position = (
        f"EPOSIT {four[0, k]:.2g} to {many[0, k]:.2g} {unit}, default {four[1, k]:.2g} to {many[1, k]:.2g} {unit}"
        for k, unit in ((0, "deg"), (1, "mm"))
    )
    return f"RMS from {COUNTS[0]} to {COUNTS[-1]} points, orthogonal lens: {rotation}; {position}"


def _more_is_better(found: dict[str, Array]) -> bool:
    four, many = found["orthogonal"][0], found["orthogonal"][-1]
    return bool(np.all(many[:2] < four[:2]))


STATEMENT = Statement(
    "V", "More than four points will make the algorithm more robust to noise", "left to later work", _rms_text,
    "has four points only", holds_if(_more_is_better),
    "Least squares on EPOSIT's equations takes any number of points; only refinement stays at the bound.", "beyond",
)  # fmt: skip


_NAMES = ("EPOSIT", "default", "bound")


def _over_bound(lens: str, method: str, draws: int, seed: int) -> Array:
    """(frames, draws, 6) absolute error over the median that the bound allows; missing poses infinite."""
    camera, path = camera_with(lens), helix()
    pose = repeated(path, draws)
    error = errors_of(eposit.solve(OBJECT, noisy(camera, OBJECT, pose, seed), camera, method), pose)
    allowed = NORMAL_MEDIAN * bounds(information(camera, OBJECT, path))
    return np.nan_to_num(np.abs(error), nan=np.inf).reshape(len(path.t), draws, 6) / allowed[:, None]


def _median_text(values: Array) -> str:
    found: Interval = bootstrap(values, median, resamples=RESAMPLES)
    return found.text()


def _rms_errors(lens: str, draws: int, step: float, seed: int) -> Array:
    """(counts, 3, 2) RMS of rotation, deg, and position, mm, of EPOSIT, the default and the bound."""
    camera, pose, found = camera_with(lens), repeated(helix(step), draws), np.empty((len(COUNTS), 3, 2))
    for i, n in enumerate(COUNTS):
        points = cloud(n)
        pixels = noisy(camera, points, pose, seed + n)
        errors = [errors_of(eposit.solve(points, pixels, camera, method), pose) for method in METHODS]
        for j, error in enumerate((*errors, bounds(information(camera, points, pose)))):
            for k, part in enumerate((np.degrees(error[:, :3]), error[:, 3:])):
                found[i, j, k] = np.sqrt(np.nanmean(np.sum(part**2, axis=1)))
    return found


def _lines(found: dict[str, Array]) -> str:
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 4, figsize=(11, 2.9), layout="constrained")
        panels = [(lens, k) for k in (0, 1) for lens in found]
        for axis, (lens, k) in zip(axes, panels, strict=True):
            for j, (name, style) in enumerate(zip(_NAMES, ("o-", "s-", "k--"), strict=True)):
                axis.loglog(COUNTS, found[lens][:, j, k], style, markersize=4, linewidth=1.2, label=name)
            axis.set_title(CAMERAS[lens], fontsize=9)
            axis.set(xlabel="points", ylabel=("RMS rotation error, deg", "RMS position error, mm")[k])
            axis.set_xticks(COUNTS, [str(n) for n in COUNTS])
            low, high = axis.get_ylim()
            ticks = [tick for tick in TICKS if low <= tick <= high]
            axis.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
            axis.minorticks_off()
        axes[0].legend(fontsize=7, frameon=False)
        return svg(figure)

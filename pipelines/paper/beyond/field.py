"""Which solvers find the pose at which angle from the optical axis."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import eposit
from eposit import Camera, Pose, Solution
from eposit.arrays import Array, Mask
from pipelines.adapters.registry import find_solver
from pipelines.pages.sections import Drawing, Table
from pipelines.pages.svg import STYLE, svg
from pipelines.paper.claims import PaperSection
from pipelines.paper.problems import EXACT_RAD, OBJECT, SIGMA_PX, at_field_angle, bounds, errors_of, information, noisy
from pipelines.statistics import Interval, percent, wilson

ANGLES = tuple(range(0, 111, 5))
SOLVERS = ("posit", "eposit", "centred", "best", "opencv-sqpnp")
LINEAR = ("posit", "eposit", "centred")
UNDER = ("posit", "centred")  # drawn wide: the next curve lies on them
ITERATIONS = 500  # of a linear method; what takes longer lies at its limit
NOISY_BOUNDS = 5.0
LIMIT_DEG = float(np.rad2deg(np.arctan(np.sqrt(2.0))))
# Sees 180 degrees all round; the picture is large enough for all that is asked.
WIDE = Camera(lens="equidistance", fx=552.0, fy=552.0, cx=1800.0, cy=1800.0, width=3601, height=3601)


def field(trials: int = 200, angles: tuple[int, ...] = ANGLES, seed: int = 1) -> PaperSection:
    """Success against field angle, on exact points and with noise of 0.4 px."""
    exact = _rates(trials, angles, seed, _exact_success)
    with_noise = _rates(trials, angles, seed, _noisy_success)
    intro = (
        f"The paper's four points at 2 m, M0 at the field angle, {trials} random rotations an angle, an equidistance "
        "lens of 552 px that sees to 180 degrees. EPOSIT and POSIT divide by the cosine of the incidence angle, and "
        f"their iteration contracts by tan(theta) / sqrt 2 a step: the limit is {LIMIT_DEG:.1f} degrees. The centred "
        "form turns M0's ray onto the axis first. OpenCV's SQPNP is given rectified points, which end at 90 degrees."
    )
    kinds = (
        ("exact points", f"rotation within {EXACT_RAD:g} rad", exact),
        (f"noise of {SIGMA_PX:g} px", f"all six errors within {NOISY_BOUNDS:g} Cramer-Rao bounds", with_noise),
    )
    tables = tuple(
        _table(f"Success against field angle, {name}", angles, found, f"Success: {what}. 95 % intervals by Wilson.")
        for name, what, found in kinds
    )
    drawing = Drawing(
        "Success against field angle",
        curves(angles, {name: found for name, _, found in kinds}),
        f"The dashed line is EPOSIT's limit of {LIMIT_DEG:.1f} degrees; bands are 95 % intervals. "
        "POSIT and EPOSIT coincide.",
    )
    return PaperSection("Success against field angle", intro, (drawing, *tables))


def solve_by(name: str, points_in_obj: Array, pixels: Array, camera: Camera, sigma_px: Any = None) -> Solution:
    """Solve with a solver's name; the linear methods with their limit of iterations."""
    if name in LINEAR:
        return eposit.solve(points_in_obj, pixels, camera, name, max_iterations=ITERATIONS)
    return find_solver(name)(points_in_obj, pixels, camera, sigma_px=sigma_px)


def _rates(
    trials: int, angles: tuple[int, ...], seed: int, success: Callable[[str, Pose, int], Mask]
) -> dict[str, list[Interval]]:
    found: dict[str, list[Interval]] = {name: [] for name in SOLVERS}
    for angle in angles:
        pose = at_field_angle(angle, trials, seed + angle)
        for name in SOLVERS:
            found[name].append(wilson(success(name, pose, seed + angle)))
    return found


def _exact_success(name: str, pose: Pose, seed: int) -> Mask:
    error = errors_of(solve_by(name, OBJECT, WIDE.project(pose.apply(OBJECT)), WIDE), pose)
    return np.linalg.norm(error[:, :3], axis=1) < EXACT_RAD


def _noisy_success(name: str, pose: Pose, seed: int) -> Mask:
    solution = solve_by(name, OBJECT, noisy(WIDE, OBJECT, pose, seed), WIDE)
    return np.all(np.abs(errors_of(solution, pose)) < NOISY_BOUNDS * bounds(information(WIDE, OBJECT, pose)), axis=1)


def _table(title: str, angles: tuple[int, ...], found: dict[str, list[Interval]], note: str) -> Table:
    rows = tuple((f"{angle}", *(percent(found[name][i], 0) for name in SOLVERS)) for i, angle in enumerate(angles))
    return Table(title, ("M0 off the axis, deg", *SOLVERS), rows, note)


def curves(angles: tuple[int, ...], panels: dict[str, dict[str, list[Interval]]]) -> str:
    """One panel for each kind of points, one curve for each solver."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, len(panels), figsize=(10, 3.2), layout="constrained", sharey=True, squeeze=False)
        for axis, (title, found) in zip(axes[0], panels.items(), strict=True):
            axis.axvline(LIMIT_DEG, color="0.6", linewidth=0.8, linestyle="--")
            for i, (name, values) in enumerate(found.items()):
                low, middle, high = (
                    [100.0 * getattr(one, side) for one in values] for side in ("low", "value", "high")
                )
                wide = 4.0 if name in UNDER else 1.2
                axis.plot(
                    angles, middle, marker="os^Dv"[i % 5], color=f"C{i}", markersize=4, linewidth=wide, label=name
                )
                axis.fill_between(angles, low, high, color=f"C{i}", alpha=0.15, linewidth=0.0)
            axis.set(title=title, xlabel="field angle, degrees", ylim=(-3.0, 103.0))
        axes[0][0].set_ylabel("success, %")
        axes[0][0].legend(fontsize=7, frameon=False, loc="lower left")
        return svg(figure)

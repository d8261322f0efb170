"""The paper's simulation: its object on its helix, seen through five lenses, shared noise, and every solver on it."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import eposit
from eposit import Camera, Pose, Solution, Status, gpnpf, opnp, pnpfr, released
from eposit.arrays import Array, Mask
from eposit.pose import euler_error_rad
from pipelines.adapters.registry import find_solver
from pipelines.paper.problems import OBJECT, SIGMA_PX, camera_with, errors_of, helix, nominal_camera_with, taken
from pipelines.stages.score import is_gross_failure
from pipelines.statistics import Interval, bootstrap, mean

LENSES = ("perspective", "stereographic", "equidistance", "equisolid", "orthogonal")
FISHEYES = LENSES[1:]
CENTRE_PX = (800.0, 600.0)  # of the image, which the paper measures theta from
COMPONENTS = ("rx", "ry", "rz", "x", "y", "z")
UNITS = ("deg", "deg", "deg", "mm", "mm", "mm")
ROTATION, PLACE, DEPTH = slice(0, 3), slice(3, 5), slice(5, 6)  # of the six
MEANS_HEAD = ("camera", "method", *(f"{name}, {unit}" for name, unit in zip(COMPONENTS, UNITS, strict=True)))

Estimate = Callable[["Draws"], Solution]


@dataclass(frozen=True, slots=True)
class Draws:
    """Noisy images of the object: `seeds` draws of every pose of the helix, one after the other."""

    lens: str
    camera: Camera  # the true one
    pose: Pose  # (seeds * poses,) the truth
    pixels: Array  # (seeds * poses, 4, 2)
    seeds: int

    @property
    def nominal(self) -> Camera:
        """Nominal focal length and image centre: a user without calibration."""
        return nominal_camera_with(self.lens)

    @property
    def paper(self) -> Camera:
        """Nominal focal length, true principal point."""
        return self.nominal.replace(cx=self.camera.cx, cy=self.camera.cy)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Errors of one solver on draws, estimate minus truth."""

    error: Array  # (seeds, poses, 6): rx, ry, rz in degrees, x, y, z in mm; NaN where there is no pose
    vector: Array  # (seeds * poses, 6): rotation vector, rad, and t, mm, as a pose's covariance has them
    failed: Mask  # (seeds, poses) no pose
    gross_failure: Mask  # (seeds, poses) no pose, or one far away: the paper's star


def draws(lens: str, seeds: int, sigma_px: float = SIGMA_PX, path: Pose | None = None, shared: bool = True) -> Draws:
    """Draws of the paper's simulation. shared: one draw of noise for all lenses, as in the paper."""
    camera, pose = camera_with(lens), helix() if path is None else path
    exact = camera.project(pose.apply(OBJECT))
    own = () if shared else (1 + LENSES.index(lens),)
    noise = [np.random.default_rng((seed, *own)).standard_normal(exact.shape) for seed in range(seeds)]
    pixels = np.concatenate([exact + sigma_px * part for part in noise])
    order = np.arange(seeds * len(pose.t)) % len(pose.t)
    return Draws(lens, camera, taken(pose, order), pixels, seeds)


def outcome(problem: Draws, estimate: Estimate) -> Outcome:
    """What a solver makes of the draws."""
    solution = estimate(problem)
    failed = np.asarray(solution.status) != Status.OK
    angles = np.degrees(euler_error_rad(solution.cam_from_obj.R, problem.pose.R))
    shift = solution.cam_from_obj.t - problem.pose.t
    gross = is_gross_failure(failed, solution.cam_from_obj.t, problem.pose.t)
    error = np.where(failed[:, None], np.nan, np.hstack((angles, shift)))
    shape = (problem.seeds, -1)
    return Outcome(
        error.reshape(*shape, 6), errors_of(solution, problem.pose), failed.reshape(shape), gross.reshape(shape)
    )


def equations(problem: Draws, theta_centre: tuple[float, float] | None = CENTRE_PX) -> Solution:
    """EPOSIT by the paper's equations, its camera, theta from the image centre; from the principal point if None."""
    return eposit.solve(OBJECT, problem.pixels, problem.paper, "eposit", theta_centre=theta_centre)


def as_released(problem: Draws, theta_centre: tuple[float, float] | None = CENTRE_PX) -> Solution:
    """The released code's behaviour, likewise."""
    return released.solve(OBJECT, problem.pixels, problem.paper, theta_centre=theta_centre)


equations_from_principal_point = functools.partial(equations, theta_centre=None)
as_released_from_principal_point = functools.partial(as_released, theta_centre=None)


def equations_at_centre(problem: Draws) -> Solution:
    """EPOSIT by the paper's equations with the image centre as principal point everywhere."""
    return eposit.solve(OBJECT, problem.pixels, problem.nominal, "eposit")


def as_released_at_centre(problem: Draws) -> Solution:
    """The released code's behaviour, likewise."""
    return released.solve(OBJECT, problem.pixels, problem.nominal)


def eposit_exact(problem: Draws) -> Solution:
    """EPOSIT by the paper's equations with the true camera."""
    return eposit.solve(OBJECT, problem.pixels, problem.camera, "eposit")


def as_released_exact(problem: Draws) -> Solution:
    """The released code's behaviour with the true camera."""
    return released.solve(OBJECT, problem.pixels, problem.camera)


def best(problem: Draws) -> Solution:
    """Our default solver with the true camera."""
    return eposit.solve(OBJECT, problem.pixels, problem.camera, sigma_px=SIGMA_PX)


def with_opnp(problem: Draws) -> Solution:
    """OPnP with the true camera, as in the paper."""
    return opnp.solve(OBJECT, problem.pixels, problem.camera)


def with_gpnpf(problem: Draws) -> Solution:
    """GPnPf about the image centre, as in the paper."""
    return gpnpf.solve(OBJECT, problem.pixels, problem.nominal)


def with_pnpfr(problem: Draws) -> Solution:
    """PnPfr about the image centre, as in the paper, by its stated rule."""
    return pnpfr.solve(OBJECT, problem.pixels, problem.nominal)


def with_gpnpf_at_principal_point(problem: Draws) -> Solution:
    """GPnPf about the true principal point, which the paper's figures of EPOSIT have subtracted."""
    return gpnpf.solve(OBJECT, problem.pixels, problem.paper)


def with_pnpfr_at_principal_point(problem: Draws) -> Solution:
    """PnPfr likewise."""
    return pnpfr.solve(OBJECT, problem.pixels, problem.paper)


def with_pnpfr_root(problem: Draws, which: str) -> Solution:
    """PnPfr about the image centre, its `first` root or the `best` one, which only the truth can tell."""
    solution = pnpfr.solve(OBJECT, problem.pixels, problem.nominal)
    poses = solution.candidates.poses
    usable = np.isfinite(solution.candidates.cost)
    if which == "best":
        with np.errstate(invalid="ignore"):
            far = np.linalg.norm(poses.R - problem.pose.R[:, None], axis=(2, 3))
        index = np.argmin(np.where(usable, far, np.inf), axis=1)
    else:
        index = np.argmax(usable, axis=1)
    b = np.arange(len(index))
    ok = usable[b, index]
    pose = Pose(
        np.where(ok[:, None, None], poses.R[b, index], np.nan), np.where(ok[:, None], poses.t[b, index], np.nan)
    )
    nothing: Any = np.full(len(b), np.nan)
    return Solution(
        np.where(ok, Status.OK, Status.NO_SOLUTION),
        pose,
        np.zeros(len(b), int),
        nothing,
        np.full((len(b), 6, 6), np.nan),
    )


def named(name: str) -> Estimate:
    """A solver of `pipelines.adapters` with the true camera."""
    return lambda problem: find_solver(name)(OBJECT, problem.pixels, problem.camera)


def mean_over_draws(values: Array) -> Interval:
    """Mean over seeds and poses, with the interval over seeds. values: (seeds, poses, ...)."""
    return bootstrap(values.reshape(len(values), -1), mean)

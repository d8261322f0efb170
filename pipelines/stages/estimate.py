"""Stage 3: poses from points. A new solver, camera or choice of points adds shards; nothing is rendered again."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

from datasets.errors import UserError
from datasets.plan import Stream, rng_for, shard_count
from datasets.rows import camera_of, covariances_by_frame, estimate_rows, joint_factors_by_frame, points_by_frame
from datasets.schema import FRAMES
from datasets.store.dataset import Dataset
from eposit import Solution, Status
from eposit.arrays import Array, Mask
from pipelines.adapters.limits import DEFAULT, Limits
from pipelines.adapters.process import Form, function_process
from pipelines.adapters.registry import find_solver, takes_theta_centre
from pipelines.adapters.results import PoseResult, Solver, gather
from pipelines.adapters.user import SIGMA, SOLVER_FORM, as_solver, is_given
from pipelines.stages.detect import path_of
from pipelines.stages.joint_pose import as_if_independent, jointly
from pipelines.stages.settings import Setting, assumed

REACHES_BOUND = "best"  # the solver that weighs its points, so that their covariances tell the pose's


def is_done(dataset: Dataset, index: int, setting: Setting) -> bool:
    """Whether a shard is there."""
    return dataset.is_done(path_of_shard(dataset, index, setting.name))


def run_shard(dataset: Dataset, index: int, setting: Setting, limits: Limits = DEFAULT) -> str | None:
    """Make one shard of `estimates`; what a user's function first failed with, if it did.

    limits: of such a function, which runs in a process of its own.
    """
    notes: list[str] = []
    solver = solver_of(setting.solver, notes.append, limits)
    count = shard_count(dataset.recipe)
    columns = [name for name in FRAMES.names if name != "image"]
    frames = dataset.read_shard(dataset.shard_path("frames", index, count), columns).to_pylist()
    target, detected = dataset.recipe.target, setting.points == "detected"
    path = path_of(dataset, index, setting.detector) if detected else dataset.shard_path("keypoints", index, count)
    rows = dataset.read_shard(path)
    points = points_by_frame(rows, target)
    sigmas = covariances_by_frame(rows, target) if detected else {}
    factors = joint_factors_by_frame(rows, target) if detected else {}
    parts: list[pa.Table] = []
    for frame in frames:
        frame_id, before = frame["frame_id"], len(notes)
        seen = _FramePoints(points[frame_id], sigmas.get(frame_id), factors.get(frame_id))
        parts.append(_estimate(dataset, frame, seen, setting, solver))
        notes[before:] = [f"frame {frame_id}: {note}" for note in notes[before:]]
    dataset.write_shard(path_of_shard(dataset, index, setting.name), pa.concat_tables(parts))
    return notes[0] if notes else None


def solver_of(name: str, tell: Callable[[str], None] = lambda _: None, limits: Limits = DEFAULT) -> Solver:
    """The solver of a name; a user's function in a process of its own.

    tell: called with one line for every image on which a user's function failed.

    Raises:
        UserError: an unknown name, or a user's function that cannot be imported or called.
    """
    if not is_given(name):
        return find_solver(name)
    process = function_process(name, Form("--solver", SOLVER_FORM, 3, SIGMA), limits)
    return as_solver(functools.partial(process.call, tell), process.takes_keyword)


def path_of_shard(dataset: Dataset, index: int, name: str) -> Path:
    """Place of one shard of the estimates that have a name."""
    return dataset.shard_path("estimates", index, shard_count(dataset.recipe), name)


class _FramePoints(NamedTuple):
    """Points of one frame and what is stated of them; NaN where one was not found."""

    pixels: Array  # (n, 2)
    sigma: Array | None  # (n, 2, 2) covariances of detected points, px^2
    factor: Array | None  # (n, 2, k) px, of their joint covariance, see `joint_pose`


@dataclass(frozen=True, slots=True)
class _SolverInput:
    """What a solver is given of one frame."""

    points_in_obj: Array  # (n, 3) mm
    points_px: Array  # (b, n, 2), one image for each draw; NaN where a point was not found
    sigma_px: Array | float | None  # as for `eposit.solve`; None for points without noise
    factor: Array | None = None  # (n, 2, k) px, of points whose errors are shared

    @property
    def has_enough_points(self) -> bool:
        """Whether the four points that a pose needs were found."""
        return bool(np.sum(_is_found(self.points_px)) >= 4)


def _estimate(
    dataset: Dataset,
    frame: dict[str, Any],
    seen: _FramePoints,
    setting: Setting,
    solver: Solver,
) -> pa.Table:
    """Rows of one frame, one for each draw."""
    given = _solver_input(dataset, frame, seen, setting)
    solution = _solved(given, frame, setting, solver)
    draws = range(len(given.points_px))
    key = (setting.solver, setting.points_name, setting.camera, setting.use)
    return estimate_rows([frame["frame_id"]] * len(draws), draws, key, solution, len(given.points_in_obj))


def _solver_input(dataset: Dataset, frame: dict[str, Any], seen: _FramePoints, setting: Setting) -> _SolverInput:
    """The points that the setting chooses, with its noise. Of all points, those that were not found are left out."""
    points_in_obj, noisy, four = dataset.recipe.target.points, setting.points == "truth+noise", setting.use == "four"
    images = [seen.pixels]
    if noisy:
        images = [seen.pixels + _noise(dataset, frame, draw, setting) for draw in range(setting.draws)]
    chosen = np.array(dataset.recipe.four_indices()) if four else np.arange(len(points_in_obj))
    batch = np.stack(images)[:, chosen]
    if not four:
        found = _is_found(batch)
        chosen, batch = chosen[found], batch[:, found]
    if noisy:
        return _SolverInput(points_in_obj[chosen], batch, setting.noise_px)
    sigma, factor = (None if part is None else part[chosen] for part in (seen.sigma, seen.factor))
    return _SolverInput(points_in_obj[chosen], batch, sigma, factor)


def _is_found(batch: Array) -> Mask:
    """(n,) which points of (b, n, 2) px were found; the draws of noise have the same."""
    return np.all(np.isfinite(batch[0]), axis=1)


def _solved(given: _SolverInput, frame: dict[str, Any], setting: Setting, solver: Solver) -> Solution:
    """The poses of each draw, with their covariance where the solver's reaches the bound and the points' is known."""
    b = len(given.points_px)
    if not given.has_enough_points:
        answers = [PoseResult(Status.POINTS_MISSING)] * b
        return gather(given.points_in_obj, given.points_px, camera_of(frame), answers, single=False)
    factor = given.factor if setting.solver == REACHES_BOUND else None
    sigma = given.sigma_px if factor is None else as_if_independent(factor)
    solution = solve_with(setting, given.points_in_obj, given.points_px, frame, sigma, solver)
    if factor is not None:
        return jointly(solution, given.points_in_obj, given.points_px, assumed(frame, setting.camera), factor)
    if given.sigma_px is not None and (setting.solver == REACHES_BOUND or is_given(setting.solver)):
        return solution
    return replace(solution, covariance=np.full((b, 6, 6), np.nan))


def _noise(dataset: Dataset, frame: dict[str, Any], draw: int, setting: Setting) -> Array:
    """Noise of one draw, keyed by the pose, so that the lenses of one pose share it as in the paper."""
    rng = rng_for(dataset.recipe.seed, Stream.POINT_NOISE, frame["pose_id"], draw)
    return setting.noise_px * rng.standard_normal((len(dataset.recipe.target.points), 2))


def solve_with(
    setting: Setting,
    points_in_obj: Array,
    batch: Array,
    frame: dict[str, Any],
    sigma_px: Array | float | None = None,
    solver: Solver | None = None,
) -> Solution:
    """Solve a batch with the camera that the setting assumes; `sigma_px` as for `eposit.solve`.

    solver: the setting's, if it is at hand already.

    Raises:
        UserError: the solver does not take these points.
    """
    camera = assumed(frame, setting.camera)
    centre: dict[str, Any] = {}
    if setting.camera == "paper" and takes_theta_centre(setting.solver):
        centre = {"theta_centre": (camera.width / 2.0, camera.height / 2.0)}
    solver = solver or find_solver(setting.solver)
    try:
        return solver(points_in_obj, batch, camera, sigma_px=sigma_px, **centre)
    except UserError:
        raise
    except ValueError as error:
        raise UserError(f"solver {setting.solver} does not take these points: {error}") from error

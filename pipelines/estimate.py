"""Stage 3: poses from points. A new solver, camera or choice of points adds shards; nothing is rendered again."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pyarrow as pa

import eposit
from datasets.errors import UserError
from datasets.plan import Stream, rng_for, shard_count
from datasets.recipe import assumed_camera
from datasets.schema import ESTIMATES, FRAMES
from datasets.store import Dataset
from eposit import Solution
from eposit.arrays import Array
from pipelines.detect import check_detector, path_of
from pipelines.detection import Detector
from pipelines.rows import camera_of, covariances_by_frame, points_by_frame, pose_columns, table

POINTS = ("detected", "truth", "truth+noise")
CAMERAS = ("exact", "nominal", "paper")
USES = ("four", "all")
REACHES_BOUND = "best"  # the solver that weighs its points, so that their covariances tell the pose's


@dataclass(frozen=True, slots=True)
class Setting:
    """One way to estimate: which solver, from which points, with which camera.

    Raises:
        UserError: an unknown word, or a number out of range.
    """

    solver: Annotated[str, "a method of eposit.solve"] = "best"
    points: Annotated[str, "detected, truth or truth+noise"] = "detected"
    camera: Annotated[str, "camera the solver assumes: exact, nominal or paper"] = "exact"
    use: Annotated[str, "object points: four or all"] = "all"
    noise_px: Annotated[float, "standard deviation of truth+noise, px per axis"] = 0.4
    draws: Annotated[int, "draws of truth+noise"] = 5
    detector: Annotated[str, "whose points `detected` are"] = Detector.EDGE_FIT

    def __post_init__(self) -> None:
        for name, allowed in (("solver", eposit.METHODS), ("points", POINTS), ("camera", CAMERAS), ("use", USES)):
            if getattr(self, name) not in allowed:
                raise UserError(f"unknown {name} {getattr(self, name)!r}; choose one of {', '.join(allowed)}")
        check_detector(self.detector)
        if not 0.0 < self.noise_px <= 100.0:
            raise UserError(f"noise of {self.noise_px} px is not usable; give --noise-px above 0 and at most 100")
        if not 1 <= self.draws <= 10000:
            raise UserError(f"{self.draws} draws are not usable; give --draws from 1 to 10000")

    @property
    def points_name(self) -> str:
        """Name in tables, with the noise or the detector, unless that is ours."""
        if self.points == "detected" and self.detector != Detector.EDGE_FIT:
            return f"detected-{self.detector}"
        return f"truth+{self.noise_px:g}px" if self.points == "truth+noise" else self.points

    @property
    def name(self) -> str:
        """Name of the shards."""
        draws = f"-x{self.draws}" if self.points == "truth+noise" else ""
        return f"{self.solver}-{self.points_name}{draws}-{self.camera}-{self.use}"


def is_done(dataset: Dataset, index: int, setting: Setting) -> bool:
    """Whether a shard is there."""
    return dataset.is_done(_path(dataset, index, setting))


def run_shard(dataset: Dataset, index: int, setting: Setting) -> None:
    """Make one shard of `estimates`."""
    count = shard_count(dataset.recipe)
    columns = [name for name in FRAMES.names if name != "image"]
    frames = dataset.read_shard(dataset.shard_path("frames", index, count), columns).to_pylist()
    target, detected = dataset.recipe.target, setting.points == "detected"
    path = path_of(dataset, index, setting.detector) if detected else dataset.shard_path("keypoints", index, count)
    rows = dataset.read_shard(path)
    points = points_by_frame(rows, target)
    sigmas = covariances_by_frame(rows, target) if detected else {}
    parts = [
        _estimate(dataset, frame, points[frame["frame_id"]], sigmas.get(frame["frame_id"]), setting) for frame in frames
    ]
    dataset.write_shard(_path(dataset, index, setting), pa.concat_tables(parts))


def _path(dataset: Dataset, index: int, setting: Setting) -> Path:
    return dataset.shard_path("estimates", index, shard_count(dataset.recipe), setting.name)


def _estimate(
    dataset: Dataset, frame: dict[str, Any], points_px: Array, sigma: Array | None, setting: Setting
) -> pa.Table:
    """Rows of one frame, one for each draw. sigma: (n, 2, 2) covariances of detected points, px^2."""
    target = dataset.recipe.target
    chosen = np.array(dataset.recipe.four_indices()) if setting.use == "four" else np.arange(len(target.points))
    noisy = setting.points == "truth+noise"
    draws = range(setting.draws if noisy else 1)
    batch = np.stack([points_px + _noise(dataset, frame, draw, setting) if noisy else points_px for draw in draws])[
        :, chosen
    ]
    found = np.all(np.isfinite(batch[0]), axis=1)
    if setting.use == "all":  # a point that was not found takes no part; of four, none may be missing
        chosen, batch = chosen[found], batch[:, found]
    b = len(batch)
    if np.sum(found) < 4:
        R, t = np.full((b, 3, 3), np.nan), np.full((b, 3), np.nan)
        status = np.full(b, "points_missing")
        iterations, rmse = np.zeros(b, np.int64), np.full(b, np.nan)
        covariance = np.full((b, 6, 6), np.nan)
    else:
        known = setting.noise_px if noisy else None if sigma is None else sigma[chosen]
        stated = known is not None and setting.solver == REACHES_BOUND
        solution = solve_with(setting, target.points[chosen], batch, frame, known)
        covariance = solution.covariance if stated else np.full((b, 6, 6), np.nan)
        R, t, status = solution.cam_from_obj.R, solution.cam_from_obj.t, solution.status
        iterations, rmse = solution.iterations, solution.reprojection_rmse_px
    return table(
        ESTIMATES,
        {
            "frame_id": np.full(b, frame["frame_id"]),
            "solver": np.full(b, setting.solver),
            "points": np.full(b, setting.points_name),
            "camera": np.full(b, setting.camera),
            "use": np.full(b, setting.use),
            "draw": np.arange(b),
            "status": status,
            "n_points": np.full(b, len(chosen)),
            **pose_columns(R, t),
            "iterations": iterations,
            "reprojection_rmse_px": rmse,
            "covariance": list(covariance.reshape(b, 36)),
        },
    )


def _noise(dataset: Dataset, frame: dict[str, Any], draw: int, setting: Setting) -> Array:
    """Noise of one draw, keyed by the pose, so that the lenses of one pose share it as in the paper."""
    rng = rng_for(dataset.recipe.seed, Stream.POINT_NOISE, frame["pose_id"], draw)
    return setting.noise_px * rng.standard_normal((len(dataset.recipe.target.points), 2))


def solve_with(
    setting: Setting, points_in_obj: Array, batch: Array, frame: dict[str, Any], sigma_px: Array | float | None = None
) -> Solution:
    """Solve a batch with the camera that the setting assumes; `sigma_px` as for `eposit.solve`.

    exact: the true camera. nominal: nominal focal length, image centre. paper: nominal focal length, the true
    principal point subtracted from x and y, the image centre inside theta (EPOSIT only; other methods measure
    theta from the principal point).
    """
    true = camera_of(frame)
    if setting.camera == "exact":
        return eposit.solve(points_in_obj, batch, true, setting.solver, sigma_px=sigma_px)
    nominal = assumed_camera(true, frame["nominal_f_px"])
    if setting.camera == "nominal":
        return eposit.solve(points_in_obj, batch, nominal, setting.solver, sigma_px=sigma_px)
    shifted = nominal.replace(cx=true.cx, cy=true.cy)
    centre = (nominal.cx, nominal.cy) if setting.solver == "eposit" else None
    return eposit.solve(points_in_obj, batch, shifted, setting.solver, sigma_px=sigma_px, theta_centre=centre)

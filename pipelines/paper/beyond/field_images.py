"""The same question on rendered pictures: success on detected points of a dataset made from the recipe `wide`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from datasets.errors import UserError
from datasets.plan import shard_count
from datasets.rows import camera_of, covariances_by_frame, points_by_frame, poses
from datasets.schema import FRAMES
from datasets.store.dataset import Dataset, open_dataset
from eposit import Camera, Pose
from eposit.arrays import Array
from eposit.pose import rotation_error_rad
from pipelines.detection import Detector
from pipelines.pages.sections import Drawing, Table
from pipelines.paper.beyond.field import LIMIT_DEG, SOLVERS, curves, solve_by
from pipelines.paper.claims import PaperSection
from pipelines.stages.detect import path_of
from pipelines.statistics import Interval, percent, wilson

ROTATION_DEG = 2.0
RELATIVE = 0.02  # of the distance


@dataclass(frozen=True, slots=True)
class _Seen:
    """One picture's four points."""

    angle: int  # of the board's centre from the optical axis, degrees, to the nearest 5
    camera: Camera
    truth: Pose
    pixels: Array  # (4, 2) detected, NaN where not
    sigma: Array  # (4, 2, 2) px^2

    @property
    def found(self) -> bool:
        return bool(np.all(np.isfinite(self.pixels)))


def field_of_images(folder: Path) -> PaperSection:
    """Success of each solver on detected points, for each field angle of the dataset's boards.

    Raises:
        UserError: the folder holds no dataset with frames and detections.
    """
    dataset = open_dataset(folder)
    obj = dataset.recipe.target.points[np.array(dataset.recipe.four_indices())]
    seen = _by_angle(_pictures(dataset))
    if not seen:
        raise UserError(f"{folder} has no frames; run the recipe wide into it first")
    found = {name: [_success(name, obj, pictures) for pictures in seen.values()] for name in SOLVERS}
    head = ("board's centre off the axis, deg", "boards found", *SOLVERS)
    note = (
        f"Success: rotation within {ROTATION_DEG:g} degrees and position within {100 * RELATIVE:g} % of the distance, "
        "from the four points of the recipe as detected in the picture. Rates are over boards found."
    )
    intro = (
        "Rendered pictures through five lenses, points found in them, four of them given to each solver. M0 is a "
        f"corner of the board, so that its angle may lie on either side of EPOSIT's limit of {LIMIT_DEG:.1f} degrees "
        "where the board's centre does not. The circle is 10 mm high: the four points are nearly flat, which the "
        "linear methods pay for."
    )
    drawing = Drawing("Success on detected points", curves(tuple(seen), {"detected points": found}))
    return PaperSection(
        "Field angle in rendered pictures",
        intro,
        (drawing, Table("Success on detected points", head, _rows(seen, found), note)),
    )


def _by_angle(pictures: Iterable[_Seen]) -> dict[int, list[_Seen]]:
    """Field angle to its pictures, from the axis outwards."""
    found: dict[int, list[_Seen]] = {}
    for one in pictures:
        found.setdefault(one.angle, []).append(one)
    return dict(sorted(found.items()))


def _success(name: str, points_in_obj: Array, pictures: Iterable[_Seen]) -> Interval:
    """A solver's share of the boards that were found; 0 where none was."""
    return wilson(np.array([_succeeds(name, points_in_obj, one) for one in pictures if one.found] or [False]))


def _rows(seen: dict[int, list[_Seen]], found: dict[str, list[Interval]]) -> tuple[tuple[str, ...], ...]:
    """A row for each angle. found: a solver's intervals, in the order of the angles."""
    rows: list[tuple[str, ...]] = []
    for (angle, pictures), *shares in zip(seen.items(), *found.values(), strict=True):
        boards = sum(one.found for one in pictures)
        cells = [percent(share, 0) if boards else "no board found" for share in shares]
        rows.append((str(angle), f"{boards} of {len(pictures)}", *cells))
    return tuple(rows)


def _succeeds(name: str, points_in_obj: Array, one: _Seen) -> bool:
    solution = solve_by(name, points_in_obj, one.pixels, one.camera, one.sigma)
    rotation = np.degrees(rotation_error_rad(solution.cam_from_obj.R, one.truth.R))
    miss = np.linalg.norm(solution.cam_from_obj.t - one.truth.t) / np.linalg.norm(one.truth.t)
    return bool(rotation < ROTATION_DEG and miss < RELATIVE)


def _pictures(dataset: Dataset) -> Iterator[_Seen]:
    count, target = shard_count(dataset.recipe), dataset.recipe.target
    four = np.array(dataset.recipe.four_indices())
    columns = [name for name in FRAMES.names if name != "image"]
    for index in range(count):
        frames = dataset.read_shard(dataset.shard_path("frames", index, count), columns)
        rows = dataset.read_shard(path_of(dataset, index, Detector.EDGE_FIT))
        points, sigmas = points_by_frame(rows, target), covariances_by_frame(rows, target)
        truth = poses(frames)
        for i, frame in enumerate(frames.to_pylist()):
            pose, key = Pose(truth.R[i], truth.t[i]), frame["frame_id"]
            x, y, z = pose.apply(target.board_centre[None])[0]
            angle = 5 * round(np.degrees(np.arctan2(np.hypot(x, y), z)) / 5.0)
            yield _Seen(int(angle), camera_of(frame), pose, points[key][four], sigmas[key][four])

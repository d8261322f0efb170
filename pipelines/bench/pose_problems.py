"""Objects and images on which single calls of the solvers are measured: the pinhole camera, which all of them take."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eposit import Camera, Pose
from eposit.arrays import Array
from eposit.pose import rotation_from_vector
from pipelines.paper.problems import OBJECT, SIGMA_PX, camera_with
from render.targets.chessboard import Chessboard

SEED = 20
SPREAD = 0.15  # sideways place of the centroid over its distance: within the picture


@dataclass(frozen=True, slots=True)
class Problems:
    """Images of one object, with what other solvers are given beforehand."""

    name: str
    points: Array  # (n, 3) mm
    pixels: Array  # (b, n, 2) px, with the paper's noise
    pose: Pose  # (b,) the true poses
    three: tuple[int, int, int]  # points for p3p, far from each other
    has_depth: bool  # whether the object is far enough from a plane for the paper's equations

    @property
    def camera(self) -> Camera:
        """The paper's pinhole camera."""
        return camera_with("perspective")


def corners() -> Array:
    """(54, 3) mm: the inner corners of the paper's board."""
    board = Chessboard()
    return board.points[: board.circle_index]


def problems(count: int) -> list[Problems]:
    """Four kinds of object, `count` images each."""
    rng = np.random.default_rng(SEED)
    near_flat = np.array([(0.0, 0.0, 0.0), (800.0, 0.0, 0.0), (0.0, 500.0, 0.0), (-50.0, 50.0, -10.0)])
    ball = rng.normal(size=(10, 3))
    ball *= 200.0 / np.linalg.norm(ball, axis=1).max()
    return [
        _images("the paper's four points", OBJECT, 2000.0, (0, 1, 2), True, count),
        _images("four near-flat points", near_flat, 2500.0, (0, 1, 2), False, count),
        _images("ten random points", ball, 1500.0, (0, 1, 2), True, count),
        _images("a board of 54 points", corners(), 2500.0, (0, 8, 45), False, count),
    ]


def half_wrong(given: Problems) -> Problems:
    """The same with every second point of each image, chosen at random, anywhere in the picture."""
    rng, pixels, camera = np.random.default_rng(SEED), given.pixels.copy(), given.camera
    for image in pixels:
        rows = rng.choice(len(image), len(image) // 2, replace=False)
        image[rows] = rng.uniform((0.0, 0.0), (camera.width, camera.height), (len(rows), 2))
    return Problems(f"{given.name}, half of them wrong", given.points, pixels, given.pose, given.three, given.has_depth)


def _images(
    name: str, points: Array, distance_mm: float, three: tuple[int, int, int], has_depth: bool, count: int
) -> Problems:
    """Poses up to about 50 degrees from facing the camera, in front of it; 0.4 px of noise."""
    rng, camera = np.random.default_rng(SEED), camera_with("perspective")
    R = rotation_from_vector(0.3 * rng.normal(size=(count, 3)))
    centre = distance_mm * np.column_stack((rng.uniform(-SPREAD, SPREAD, (count, 2)), np.ones(count)))
    pose = Pose(R, centre - R @ points.mean(axis=0))
    pixels = camera.project(pose.apply(points)) + SIGMA_PX * rng.normal(size=(count, len(points), 2))
    return Problems(name, points, pixels, pose, three, has_depth)

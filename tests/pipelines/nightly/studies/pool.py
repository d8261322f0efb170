"""Real noise draws of the recipe `nightly`: what today's detection finds in pictures that differ by noise alone.

Simulated nights take whole frames from here, so that the scatter, the correlations between metrics and the stated
covariances are those of real pictures. Kept in `out/studies`, under a hash of the code that makes and reads pictures.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
from dataclasses import dataclass

import numpy as np

from datasets.plan import plan
from datasets.recipe.model import load_recipe, parse_recipe
from datasets.recipe.override import with_regime
from datasets.store.atomic import replace_atomically
from eposit.pose import rotation_from_vector
from pipelines.detection import detect_points
from pipelines.nightly.other_code import ROOT
from pipelines.stages import generate

RECIPE, REGIMES = "nightly", ("typical", "harsh")
DRAWS = 3  # 6 ordered pairs of each of 800 frames
BLOCK = 10  # poses that are measured and kept together
MADE_BY = ("eposit", "render", "datasets", "pipelines/detection", "pipelines/stages/generate.py")
CORNER_PX, CIRCLE_PX = 0.005, 0.010  # scatter of one point in the regime `typical`, by these very draws
STEP = 1e-6  # rad, and relative to the distance, of numerical derivatives: good to 1e-9


@dataclass(frozen=True, slots=True, eq=False)  # one is what it is, by identity
class Pool:
    """R regimes, D draws, P poses, C cameras, N points, the circle last; errors are detected minus true."""

    cameras: tuple[str, ...]
    four: np.ndarray  # (4,) the points of the settings `four`
    error: np.ndarray  # (R, D, P, C, N, 2) px
    covariance: np.ndarray  # (R, D, P, C, N, 2, 2) px^2, as stated
    slope: np.ndarray  # (P, C, N, 2, 6) derivative of a point by the pose: rotation on the left in rad, then mm
    offset: np.ndarray  # (P, C, N, 2) px from the true principal point


@functools.cache
def pool():
    """The pool; parts that are not there are measured, all of them in some five minutes of processor time."""
    recipe = recipe_of(REGIMES[0])
    parts = [[part(r, block) for block in range(_blocks(recipe))] for r in range(len(REGIMES))]
    error, covariance = (
        np.stack([np.concatenate([own[i] for own in blocks], 1) for blocks in parts]) for i in range(2)
    )
    for values in (covariance, error):
        _fill(values, error)
    names = tuple(camera.name for camera in recipe.cameras)
    slope, offset = _geometries(recipe, plan(recipe), len(names))
    return Pool(names, np.array(recipe.four_indices()), error, covariance, slope, offset)


def part(r, block):
    """Errors (D, P, C, N, 2) and covariances (D, P, C, N, 2, 2) of BLOCK poses of a regime, kept on disk."""
    path = ROOT / "out" / "studies" / f"noise-draws-{_digest()[:16]}-{REGIMES[r]}-{block}.npz"
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        recipe = recipe_of(REGIMES[r])
        cameras = len(recipe.cameras)
        frames = plan(recipe)[block * BLOCK * cameras : (block + 1) * BLOCK * cameras]
        draws = [_read(recipe, frame) for frame in frames]
        both = (np.moveaxis(np.array([[draw[i] for draw in own] for own in draws]), 1, 0) for i in range(2))
        error, covariance = (_split(values, cameras, 1) for values in both)
        with replace_atomically(path) as temporary, temporary.open("wb") as file:
            np.savez(file, error=error, covariance=covariance)
    with np.load(path) as held:
        return held["error"], held["covariance"]


def _fill(values, error):
    """Draws in which a point was not found get another draw's frame: gate `failures` is about the same pictures."""
    found = np.all(np.isfinite(error), axis=(-1, -2))  # (R, D, P, C)
    draw = np.where(found, np.arange(DRAWS)[:, None, None], np.argmax(found, axis=1)[:, None])
    regime, _, pose, camera = np.indices(found.shape)
    values[:] = values[regime, draw, pose, camera]


def _blocks(recipe):
    return -(-len(plan(recipe)) // (BLOCK * len(recipe.cameras)))


def recipe_of(regime):
    """The recipe `nightly` in one regime."""
    return parse_recipe(with_regime(load_recipe(RECIPE)[1], regime, RECIPE), RECIPE)


def synthetic(poses, rng):
    """A pool of the recipe's first poses with independent errors of known scatter, for tests that take no time."""
    recipe = recipe_of(REGIMES[0])
    cameras = len(recipe.cameras)
    slope, offset = _geometries(recipe, plan(recipe)[: poses * cameras], cameras)
    sigma = np.full(slope.shape[:3], CORNER_PX)
    sigma[..., -1] = CIRCLE_PX
    covariance = np.broadcast_to(sigma[..., None, None] ** 2 * np.eye(2), (len(REGIMES), DRAWS, *sigma.shape, 2, 2))
    error = sigma[..., None] * rng.standard_normal((len(REGIMES), DRAWS, *sigma.shape, 2))
    names = tuple(camera.name for camera in recipe.cameras)
    return Pool(names, np.array(recipe.four_indices()), error, covariance, slope, offset)


def _geometries(recipe, frames, cameras):
    found = [_geometry(recipe, frame) for frame in frames]
    return (_split(np.array([item[i] for item in found]), cameras, 0) for i in range(2))


def _read(recipe, frame):
    """Errors and covariances of each draw of one frame, whose light is rendered once."""
    linear, truth = generate._rendered(recipe, frame), generate.true_points(recipe, frame)
    found = []
    for draw in range(DRAWS):
        own = dataclasses.replace(frame, sensor_seed=frame.sensor_seed ^ (draw << 32))
        points = detect_points(generate._developed(recipe, own, linear), recipe.target)
        found.append((points.points_px - truth, points.covariance_px2))
    return found


def _geometry(recipe, frame):
    """Derivatives by the pose, (N, 2, 6), and the way from the principal point, (N, 2) px."""
    camera, pose = frame.camera.true_camera(), frame.cam_from_obj
    at = pose.R @ recipe.target.points.T
    columns = []
    for i in range(6):
        step = np.zeros(6)
        step[i] = STEP if i < 3 else STEP * np.linalg.norm(pose.t)
        sides = ((rotation_from_vector(s * step[:3]) @ at).T + pose.t + s * step[3:] for s in (1.0, -1.0))
        after, before = (camera.project(side) for side in sides)
        columns.append((after - before) / (2.0 * step[i]))
    return np.stack(columns, axis=-1), generate.true_points(recipe, frame) - (camera.cx, camera.cy)


def _split(values, cameras, axis):
    """Frames into poses and cameras."""
    return values.reshape(*values.shape[:axis], -1, cameras, *values.shape[axis + 1 :])


def _digest():
    total = hashlib.sha256(f"{DRAWS} {STEP}".encode())
    for name in MADE_BY:
        place = ROOT / name
        for path in [place] if place.is_file() else sorted(place.rglob("*")):
            if path.suffix in (".py", ".toml"):
                total.update(path.read_bytes())
    return total.hexdigest()

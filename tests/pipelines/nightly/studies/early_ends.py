"""How far the solver's poses are from their end some steps before it, on the points of the pool."""

from __future__ import annotations

import numpy as np

import eposit
from datasets.plan import plan
from eposit.pose import rotation_error_vector
from tests.pipelines.nightly.studies.pool import REGIMES, recipe_of
from tests.pipelines.nightly.studies.reading import ALL, FOUR, NOISE_PX, NOISY
from tests.pipelines.nightly.studies.steps import earlier


def moves(pool, steps, seed=0):
    """Setting to (k, P, C, 6): rotation on the left in rad and translation in mm, 1 to k steps before the last."""
    recipe, rng = recipe_of(REGIMES[0]), np.random.default_rng(seed)
    frames = plan(recipe)[: pool.slope.shape[0] * len(pool.cameras)]
    points, shape = recipe.target.points, (*pool.slope.shape[:2], steps, 6)
    found = {setting: np.zeros(shape) for setting in (ALL, FOUR, NOISY)}
    for i, frame in enumerate(frames):
        at = divmod(i, len(pool.cameras))
        camera, pose = frame.camera.true_camera(), frame.cam_from_obj
        truth = camera.project(pose.apply(points))
        error, covariance = pool.error[0, 0][at], pool.covariance[0, 0][at]
        noise = NOISE_PX * rng.standard_normal(truth.shape)
        for setting, use, off, sigma in (
            (ALL, np.arange(len(points)), error, covariance),
            (FOUR, pool.four, error, covariance[pool.four]),
            (NOISY, np.arange(len(points)), noise, NOISE_PX),
        ):
            found[setting][at] = _moves(points[use], (truth + off)[use], camera, sigma, steps)
    return {setting: np.moveaxis(values, 2, 0) for setting, values in found.items()}


def _moves(points_in_obj, points_px, camera, sigma_px, steps):
    problem = points_in_obj, points_px[None], camera
    solution = eposit.solve(*problem, sigma_px=sigma_px)
    end, found = solution.cam_from_obj, []
    for count in range(1, steps + 1):
        here = earlier(solution, count, *problem, sigma_px).cam_from_obj
        found.append(np.hstack((rotation_error_vector(here.R, end.R)[0], (here.t - end.t)[0])))
    return np.array(found)

"""Objects no larger than their noise, and rods no thicker: noise makes minima, and the lowest must be found."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import eposit
from eposit.descent import to_minimum
from eposit.pose import rotation_error_rad
from eposit.problem import validate

CAMERA = eposit.Camera(lens="equisolid", fx=552.4, fy=552.7, cx=782.4, cy=613.7, width=1600, height=1200)
TURNS = Rotation.random(40, random_state=3).as_matrix()  # a start within 55 degrees of any rotation
DECIDED = 2.0 * np.log(100.0)  # -2 log of the likelihood ratio from which two minima are decided
FAR_RAD = 0.1  # between minima: what is nearer may be one, found to within the flatness of its cost


def _minima(points, pixels, sigma, found):
    """Costs of the minima that are reached from the pose found, turned, and how far each is turned from it, rad."""
    pose, centre = found.cam_from_obj, points.mean(axis=0)
    R = TURNS @ pose.R
    t = pose.R @ centre + pose.t - R @ centre
    problem, _ = validate(points, np.broadcast_to(pixels, (len(R), *pixels.shape)).copy(), CAMERA)
    reached = to_minimum(problem, eposit.Pose(R, t))
    fine = np.asarray(reached.status) == "ok"
    turned = rotation_error_rad(reached.cam_from_obj.R[fine], pose.R)
    return np.asarray(reached.cost)[fine] / sigma**2, turned


@pytest.mark.parametrize("shape", [(1.0, 1.0, 1.0), (1.0, 1.0, 200.0)], ids=["small", "rod"])
def test_the_lowest_of_many_minima_is_found_and_its_rivals_told(shape):
    rng = np.random.default_rng(4)
    untold = 0
    for _ in range(300):
        points = rng.normal(size=(rng.choice([4, 5, 6, 8]), 3)) * shape * rng.uniform(0.5, 3.0)
        R, t = (
            Rotation.random(random_state=rng.integers(1 << 30)).as_matrix(),
            (100.0, -50.0, rng.uniform(900.0, 3000.0)),
        )
        sigma = rng.uniform(0.1, 0.6)
        pixels = CAMERA.project(points @ R.T + t) + rng.normal(0.0, sigma, (len(points), 2))
        found = eposit.solve(points, pixels, CAMERA, sigma_px=sigma)
        if found.status != "ok":  # one in thousands: noise has left no minimum before the camera
            continue
        costs, turned = _minima(points, pixels, sigma, found)
        assert found.cost < costs.min() + 1e-3 * (1.0 + costs.min())
        untold += bool(np.any((costs - found.cost < DECIDED) & (turned > FAR_RAD))) and not found.ambiguous
    assert untold <= 2  # of 300; nine minima may be there, and eight are kept

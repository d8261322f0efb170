"""What the benchmark's part `poses` calls: each solver gives the pose of the image that it is timed on."""

import cv2
import numpy as np
import pytest

import eposit
from eposit.pose import rotation_error_rad
from pipelines.bench import first_use
from pipelines.bench.other_pose_solvers import samplers, solvers
from pipelines.bench.pose_problems import half_wrong, problems
from pipelines.bench.table import Figure
from pipelines.paper.problems import SIGMA_PX

GIVEN = problems(4)
NEAR_RAD = 0.1  # a board's pose by any of them is within 0.02 rad, its other minimum 0.5 rad away


def rotation(outcome) -> np.ndarray:
    """Of what OpenCV or PoseLib returns."""
    if isinstance(outcome[0], bool):
        return cv2.Rodrigues(outcome[1])[0]
    return outcome[0].R


@pytest.mark.parametrize("given", GIVEN, ids=lambda given: given.name)
def test_each_solver_is_timed_on_problems_that_it_solves(given):
    found = eposit.solve(given.points, given.pixels, given.camera, sigma_px=SIGMA_PX)
    assert set(found.status) == {"ok"}
    if given.has_depth:
        assert set(eposit.solve(given.points, given.pixels, given.camera, "eposit").status) == {"ok"}
    calls = solvers(given)
    assert {"OpenCV SQPNP", "PoseLib p3p", "PoseLib p3p and polish"} <= set(calls)
    assert ("OpenCV ITERATIVE" in calls) == (len(given.points) > 4)
    for name, call in calls.items():
        if name == "PoseLib p3p":
            assert len(call(0)) > 0
        elif len(given.points) > 4:  # four points may have two poses, and SQPNP takes one
            assert rotation_error_rad(rotation(call(1)), given.pose.R[1]) < NEAR_RAD


def test_wrong_points_are_half_of_them_and_each_sampler_leaves_them_out():
    board = GIVEN[-1]
    given = half_wrong(board)
    assert np.all(np.sum(np.any(given.pixels != board.pixels, axis=2), axis=1) == 27)
    found = eposit.solve(given.points, given.pixels, given.camera, sigma_px=SIGMA_PX, robust=True)
    assert np.max(rotation_error_rad(found.cam_from_obj.R, given.pose.R)) < NEAR_RAD
    for call in samplers(given).values():
        assert rotation_error_rad(rotation(call(2)), given.pose.R[2]) < NEAR_RAD


@pytest.mark.full
def test_first_use_is_measured_without_and_with_the_cache(monkeypatch):
    monkeypatch.setattr(first_use, "REPEATS", 1)
    rows = {row.ours: row for row in first_use.rows("poses") if isinstance(row, Figure)}
    assert len(rows) == 5
    best = rows["first call of best, processor time"]
    assert best.figure.endswith(" s")
    assert best.value.endswith(" s")
    assert best.value != best.figure  # two processes

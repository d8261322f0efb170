"""What no solver can take is a ValueError with a sentence; many points and extreme sizes are no trouble."""

from __future__ import annotations

import tracemalloc
from decimal import Decimal

import numpy as np
import pytest

import eposit
from eposit import Camera, gpnpf
from tests.cameras import paper_camera

CAMERA = paper_camera("equisolid")
POINTS = np.random.default_rng(3).uniform(-300.0, 300.0, (8, 3))
PIXELS = CAMERA.project(POINTS + [50.0, -40.0, 2000.0])

NO_NUMBERS = {
    "texts": POINTS.astype(str),
    "complex": POINTS.astype(complex),
    "times": POINTS.astype("datetime64[s]"),
    "uneven": [[1, 2, 3], [4, 5]],
    "a word": "points",
    "a mapping": {"a": 1},
    "bytes": POINTS.tobytes(),
    "what runs out": iter(POINTS),
}
OPTIONS = {
    "method": [["best"], b"best", np.ones(3), None],
    "refine": ["yes", None, np.ones(2)],
    "robust": [1.5, np.ones(2), "no"],
    "tol": ["small", np.nan, -1.0, np.ones(2), None],
    "max_iterations": [0, 2.5, 10**9, "many", np.inf],
    "sigma_px": ["x", 0.0, -1.0, np.nan, 1e300, 1e-320, np.full((8, 2, 2), np.nan), [[1, 2], [3]], {}],
}


@pytest.mark.parametrize("name", NO_NUMBERS)
@pytest.mark.parametrize("solve", [eposit.solve, gpnpf.solve, eposit.released.solve])
def test_arrays_without_numbers(solve, name):
    with pytest.raises(ValueError, match=r"points_in_obj is .* real numbers; give an array of these"):
        solve(NO_NUMBERS[name], PIXELS, CAMERA)


@pytest.mark.parametrize("camera", [{}, "camera", 5, Camera, np.eye(3)])
@pytest.mark.parametrize("solve", [eposit.solve, gpnpf.solve, eposit.released.solve])
def test_what_is_no_camera(solve, camera):
    with pytest.raises(ValueError, match=r"camera is a \w+; it must be an eposit.Camera"):
        solve(POINTS, PIXELS, camera)


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in OPTIONS.items() for value in values])
def test_options_of_other_types(name, value):
    with pytest.raises(ValueError, match=name.replace("_px", "")) as told:
        eposit.solve(POINTS, PIXELS, CAMERA, **{name: value})
    assert len(str(told.value)) < 300


@pytest.mark.parametrize("centre", ["xy", (1.0,), (np.nan, 0.0), 5, ("a", "b")])
def test_a_centre_that_is_no_point(centre):
    with pytest.raises(ValueError, match="theta_centre"):
        eposit.solve(POINTS, PIXELS, CAMERA, "eposit", theta_centre=centre)


@pytest.mark.parametrize("value", ["x", None, [500.0], np.nan, np.inf, 10**400, 1e300, 1j, Decimal(500)])
@pytest.mark.parametrize("name", ["fx", "cx", "width"])
def test_cameras_of_other_types(name, value):
    numbers = {"fx": 500.0, "fy": 500.0, "cx": 400.0, "cy": 300.0, "width": 800, "height": 600}
    with pytest.raises(ValueError, match=f"camera {name} is"):
        Camera(lens="equisolid", **(numbers | {name: value}))
    with pytest.raises(ValueError, match="camera lens is a list"):
        Camera(lens=["equisolid"], **numbers)


def test_numbers_of_other_kinds_are_taken():
    pose = eposit.solve(POINTS, PIXELS, CAMERA).cam_from_obj
    for points in (POINTS.tolist(), POINTS.astype(np.longdouble), POINTS.astype(object), np.asfortranarray(POINTS)):
        np.testing.assert_array_equal(eposit.solve(points, PIXELS, CAMERA).cam_from_obj.t, pose.t)


@pytest.mark.parametrize("size", [1e-320, 1e-160, 1e-30, 1e30, 1e160, 1e300])
@pytest.mark.parametrize("method", ["best", "centred", "posit"])
def test_extreme_sizes_give_a_pose_of_that_size_or_none(size, method):
    found = eposit.solve(POINTS * size, PIXELS, CAMERA, method)
    if found.status == eposit.Status.OK:
        # Points in the neighbourhood of the smallest number have few digits.
        np.testing.assert_allclose(found.cam_from_obj.t / size, [50.0, -40.0, 2000.0], rtol=1e-3, atol=0.1)


@pytest.mark.parametrize("size", [1e-310, 1e-160, 1e160, 1e300])
@pytest.mark.parametrize("solve", [eposit.solve, eposit.opnp.solve, gpnpf.solve, eposit.pnpfr.solve])
@pytest.mark.filterwarnings("error")
def test_extreme_sizes_warn_of_nothing(size, solve):
    solve(POINTS[:4] * size, PIXELS[:4], CAMERA)
    CAMERA.project(POINTS * size * [1.0, 1.0, 1e-10])


def test_many_points_take_memory_as_they_grow():
    n = 200_000
    rng = np.random.default_rng(4)
    points = rng.uniform(-500.0, 500.0, (n, 3))
    pixels = CAMERA.project(points + [50.0, -40.0, 2000.0]) + rng.normal(0.0, 0.3, (n, 2))
    tracemalloc.start()
    found = eposit.solve(points, pixels, CAMERA)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.status == eposit.Status.OK
    np.testing.assert_allclose(found.cam_from_obj.t, [50.0, -40.0, 2000.0], atol=0.1)  # five deviations: .02 mm each
    assert peak < 500 * n  # bytes: some sixty numbers for each point


def test_wrong_points_among_many_are_left_out():
    """One point at a time would take minutes here; the work grows as the number of points."""
    n, wrong = 20_000, 6_000
    rng = np.random.default_rng(5)
    points = rng.uniform(-500.0, 500.0, (n, 3))
    pixels = CAMERA.project(points + [50.0, -40.0, 2000.0]) + rng.normal(0.0, 0.3, (n, 2))
    angle = rng.uniform(0.0, 2.0 * np.pi, wrong)
    pixels[:wrong] += rng.uniform(10.0, 400.0, (wrong, 1)) * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    found = eposit.solve(points, pixels, CAMERA, robust=True)
    assert not np.any(found.inliers[:wrong])
    assert np.sum(~found.inliers[wrong:]) <= 3  # of 14 000, as the test loses one point of a hundred such images
    np.testing.assert_allclose(found.cam_from_obj.t, [50.0, -40.0, 2000.0], atol=0.5)

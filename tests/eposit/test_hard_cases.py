"""Every kind of input on which a solver once failed, drawn here: the outcome that is right, in one table."""

import numpy as np
import pytest

import eposit
from eposit import Pose
from eposit.pose import rotation_error_rad, rotation_from_vector
from tests.cameras import paper_camera
from tests.eposit.test_minima import MARKER, NEAR_FLAT, board, poses_at

IMAGES = 40


def scene(points, distance, tilt, sigma, seed, lens="equisolid"):
    """Camera, poses and noisy image points of IMAGES images."""
    rng, camera = np.random.default_rng(seed), paper_camera(lens)
    pose = poses_at(rng, points, IMAGES, distance, tilt)
    return camera, pose, camera.project(pose.apply(points)) + sigma * rng.normal(size=(IMAGES, len(points), 2))


def wrong_points(pixels, count, seed=1):
    """Some image points of each image anywhere in the picture instead."""
    rng = np.random.default_rng(seed)
    for image in pixels:
        image[rng.choice(len(image), count, replace=False)] = rng.uniform((0.0, 0.0), (1600.0, 1200.0), (count, 2))
    return pixels


# Name, object, distance, mm, largest tilt, degrees, noise, px.
FOUND = [
    ("nine coplanar points that face the camera", board(3, 3), 4000.0, 0.0, 0.2),
    ("a frontal board far away", board(9, 6), 6000.0, 3.0, 0.2),
    ("four near-flat points", NEAR_FLAT, 2000.0, 40.0, 0.2),
    ("four near-flat points, exact", NEAR_FLAT, 2000.0, 40.0, 0.0),
    ("four corners of a square marker, exact", MARKER, 800.0, 60.0, 0.0),
    ("a board, exact", board(9, 6), 2000.0, 60.0, 0.0),
]
IDS = [row[0] for row in FOUND]
EXACT_RAD = 1e-6  # what rounding may leave of an exact pose where a minimum is flat


@pytest.mark.parametrize(("points", "distance", "tilt", "sigma"), [row[1:] for row in FOUND], ids=IDS)
def test_none_is_lost_nor_dearer_than_the_truth_and_poses_that_are_sure_are_right(points, distance, tilt, sigma):
    camera, pose, pixels = scene(points, distance, tilt, sigma, 3)
    found = eposit.solve(points, pixels, camera, sigma_px=sigma or None)
    assert set(found.status) == {"ok"}
    true_px2 = np.sum((camera.project(pose.apply(points)) - pixels) ** 2, axis=(1, 2))
    # Exact data leave rounding, 1e-12 px in each coordinate.
    assert np.all(found.reprojection_rmse_px**2 * len(points) <= true_px2 * (1.0 + 1e-9) + len(points) * 1e-20)
    sure = ~(found.ambiguous | found.covariance_unreliable)
    error = rotation_error_rad(found.cam_from_obj.R, pose.R)
    stated = np.sqrt(np.einsum("bii->b", found.covariance[:, :3, :3]))
    assert np.all(error[sure] <= EXACT_RAD + 5.0 * stated[sure])


@pytest.mark.parametrize("far", [1e5, 1e7])
def test_points_in_map_coordinates_have_the_pose_of_those_about_their_centroid(far):
    points = board(4, 3)
    camera, _, pixels = scene(points, 1500.0, 40.0, 0.2, 4)
    near = eposit.solve(points, pixels, camera)
    moved = eposit.solve(points + far * np.array([1.0, 0.7, -0.2]), pixels, camera)
    assert list(moved.status) == list(near.status)
    assert np.max(rotation_error_rad(moved.cam_from_obj.R, near.cam_from_obj.R)) < 1e-8


@pytest.mark.parametrize("wrong", [14, 27])
def test_wrong_points_are_left_out_or_the_status_tells(wrong):
    points = board(9, 6)
    camera, pose, pixels = scene(points, 2000.0, 40.0, 0.4, 5)
    found = eposit.solve(points, wrong_points(pixels, wrong), camera, sigma_px=0.4, robust=True)
    right = rotation_error_rad(found.cam_from_obj.R, pose.R) < 0.05
    assert np.all(right | (found.status == "inconsistent"))
    assert np.mean(found.status == "ok") > 0.9


def test_more_wrong_points_than_can_be_left_out_are_a_status():
    points = board(9, 6)
    camera, _, pixels = scene(points, 2000.0, 40.0, 0.4, 6)
    found = eposit.solve(points, wrong_points(pixels, 50), camera, sigma_px=0.4, robust=True)
    assert set(found.status) <= {"inconsistent", "not_converged"}
    assert np.isnan(found.cam_from_obj.R).all()


def test_five_rows_of_three_points_are_too_few():
    camera, points = paper_camera("perspective"), MARKER[[0, 1, 2, 1, 0]]
    pose = Pose(rotation_from_vector([0.2, 0.3, 0.1]), np.array([0.0, 0.0, 900.0]))
    assert eposit.solve(points, camera.project(pose.apply(points)), camera).status == "too_few_points"


@pytest.mark.parametrize("lens", ["stereographic", "orthogonal", "equisolid"])
def test_a_small_plane_in_any_direction_keeps_both_of_its_poses(lens):
    """A plane's least spread is rounding, of either sign where it is turned in the object's frame.

    With 1.5 px of noise on an image 10 px wide two poses cost nearly the same; that of the truth must be among them.
    """
    rng, camera = np.random.default_rng(7), paper_camera(lens)
    for _ in range(60):
        plane = rng.normal(size=(12, 3)) * (20.0, 20.0, 0.0) @ rotation_from_vector(rng.normal(size=3))
        pose = poses_at(rng, plane, 1, 3000.0, 180.0)
        pixels = camera.project(pose.apply(plane))[0] + 1.5 * rng.normal(size=(12, 2))
        found = eposit.solve(plane, pixels, camera, sigma_px=1.5)
        assert found.status == "ok"
        everything = np.concatenate((found.cam_from_obj.R[None], found.alternatives.cam_from_obj.R))
        nearest = np.nanmin(rotation_error_rad(everything, pose.R))
        # Five deviations of the stated covariance, where that is sound; the other pose is up to 180 degrees away.
        stated = np.sqrt(np.trace(found.covariance[:3, :3]))
        assert found.covariance_unreliable or nearest < 5.0 * stated


def test_a_long_object_is_not_lost():
    """Its turn about itself is hardly seen, so that the descent goes a long way."""
    rng, camera = np.random.default_rng(8), paper_camera("stereographic")
    for _ in range(150):
        long = rng.normal(size=(6, 3)) * (100.0, 1.0, 1.0)
        pose = poses_at(rng, long, 1, 1500.0, 180.0)
        pixels = camera.project(pose.apply(long))[0] + 1.5 * rng.normal(size=(6, 2))
        assert eposit.solve(long, pixels, camera).status == "ok"


def test_points_on_a_line_in_any_direction_have_a_status():
    rng, camera = np.random.default_rng(9), paper_camera("equidistance")
    for _ in range(100):
        line = np.outer(rng.normal(size=6), rng.normal(size=3)) * 100.0 + 1000.0 * rng.normal(size=3)
        assert eposit.solve(line, rng.uniform(400.0, 1100.0, (6, 2)), camera).status == "coplanar"

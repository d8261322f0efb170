"""Detection on rendered images: the demo's accuracy, disorder, and pictures that are not the board."""

import cv2
import numpy as np
import pytest

from datasets.plan import plan
from datasets.recipe import load_recipe
from eposit import Pose
from eposit.pose import tilt_rad
from pipelines.board import FINDERS, find_board
from pipelines.circle import find_circle
from pipelines.corners import refine_corners
from pipelines.detection import detect_points
from pipelines.generate import outline_centroid
from pipelines.saddle import fit_saddles
from pipelines.surface import BoardMap, grid
from render.develop import develop
from render.master import render_master

RECIPE, _ = load_recipe("demo")
TARGET = RECIPE.target
CIRCLE = TARGET.circle_index


@pytest.fixture(scope="module")
def demo():
    """(frame, image, true points) of every frame of the demo."""
    found = []
    for frame in plan(RECIPE):
        camera = frame.camera.true_camera()
        master = render_master(
            TARGET, RECIPE.light, camera, frame.cam_from_obj, samples=RECIPE.sample_count(), seed=frame.render_seed
        )
        image = develop(master.full(camera), RECIPE.sensor)
        found.append((frame, image, camera.project(frame.cam_from_obj.apply(TARGET.points))))
    return found


def test_demo_is_detected_to_a_few_hundredths_of_a_pixel(demo):
    errors, tilts, lenses, circles = [], [], [], []
    for frame, image, truth in demo:
        found = detect_points(image, TARGET)
        assert set(found.status) == {"ok"}, f"frame {frame.frame_id}"
        errors.append(found.points_px[:CIRCLE] - truth[:CIRCLE])
        circles.append(found.points_px[CIRCLE] - truth[CIRCLE])
        tilts.append(np.degrees(tilt_rad(frame.cam_from_obj.R)))
        lenses.append(frame.camera.lens)
    error, tilt, lens = np.array(errors), np.array(tilts), np.array(lenses)
    # Asked: 0.06 px RMS per axis up to 45 degrees, 0.10 beyond, means below 0.01, no corner off by 1 px. Measured:
    # 0.008, 0.009, 0.005 and 0.05; the bounds here are what is asked where that is close, else three times what is.
    for name in dict.fromkeys(lenses):
        for band, bound in ((tilt <= 45.0, 0.025), (tilt > 45.0, 0.03)):
            part = error[(lens == name) & band].reshape(-1, 2)
            assert np.sqrt(np.mean(part**2, axis=0)).max() < bound
        assert np.abs(error[lens == name].reshape(-1, 2).mean(axis=0)).max() < 0.01
    assert np.linalg.norm(error, axis=2).max() < 0.2
    circle = np.array(circles)
    assert np.sqrt(np.mean(circle**2, axis=0)).max() < 0.05


@pytest.mark.parametrize("turn", ["none", "half", "quarter"])
def test_order_follows_the_board_not_the_image(demo, turn):
    """However the picture is turned, the first corner is the board's first corner."""
    _, image, truth = demo[4]
    height, width = image.shape
    if turn == "half":
        image, truth = np.ascontiguousarray(image[::-1, ::-1]), [width - 1, height - 1] - truth
    elif turn == "quarter":
        image, truth = np.ascontiguousarray(image.T[:, ::-1]), np.stack((height - 1 - truth[:, 1], truth[:, 0]), 1)
    found = detect_points(image, TARGET)
    assert np.abs(found.points_px - truth).max() < 0.3


@pytest.mark.parametrize("finder", ["enlarged", "sector"])
def test_every_finder_sees_the_board(demo, monkeypatch, finder):
    _, image, truth = demo[2]
    monkeypatch.setattr("pipelines.board.FINDERS", {finder: FINDERS[finder]})
    found = find_board(image, TARGET)
    assert found is not None
    assert found.finder == finder
    # Before refinement: the sector finder is good to half a pixel, the classic one on an enlarged picture to one.
    assert np.abs(found.corners_px - truth[:CIRCLE]).max() < 1.5


@pytest.mark.parametrize("kind", ["black", "noise", "checks without margin", "half a board", "other board"])
def test_what_is_not_the_board_gives_a_status(demo, kind):
    rng = np.random.default_rng(0)
    image = demo[0][1].copy()
    if kind == "black":
        image[:] = 0
    elif kind == "noise":
        image = rng.integers(0, 256, (300, 400)).astype(np.uint8)  # small: the finders are slow on noise
    elif kind == "checks without margin":
        y, x = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
        image = (((x // 40 + y // 40) % 2) * 255).astype(np.uint8)
    elif kind == "half a board":
        image[:, 800:] = 60
    elif kind == "other board":
        y, x = np.mgrid[0:300, 0:300]
        image[:] = 200
        image[200:500, 200:500] = np.where((x // 50 + y // 50) % 2 == 0, 10, 200)
    found = detect_points(image, TARGET)
    assert set(found.status) <= {"board_not_found", "corners_inconsistent"}
    assert np.isnan(found.points_px).all()


def test_a_disturbed_corner_is_dropped_and_the_others_stay(demo):
    _, image, truth = demo[1]
    image = image.copy()
    x, y = np.rint(truth[30]).astype(int)
    cv2.circle(image, (int(x) + 3, int(y) + 1), 5, 10, -1)
    rough = BoardMap.fit(truth[:CIRCLE], TARGET.inner)
    corners = refine_corners(image, rough, truth[CIRCLE], TARGET)
    off = np.linalg.norm(corners.points_px - truth[:CIRCLE], axis=1)
    assert off[30] > 0.5
    assert not corners.consistent[30]
    assert corners.consistent.sum() >= CIRCLE - 2
    assert off[corners.consistent].max() < 0.1


def test_a_hidden_circle_leaves_the_corners(demo):
    _, image, truth = demo[1]
    image = image.copy()
    x, y = np.rint(truth[CIRCLE]).astype(int)
    image[y - 13 : y + 14, x - 12 : x + 11] = image[y, x - 14]
    found = detect_points(image, TARGET)
    assert found.status[CIRCLE] == "circle_not_found"
    assert np.isnan(found.points_px[CIRCLE]).all()
    assert np.mean(found.status[:CIRCLE] == "ok") > 0.9


def test_circle_bias_is_taken_off(demo):
    """At 0.9 m the outline's centroid is off by half a pixel; what is reported is the centre."""
    frame = demo[0][0]
    camera, R = frame.camera.true_camera(), frame.cam_from_obj.R
    pose = Pose(R, np.array([-30.0, 20.0, 900.0]) - R @ np.array([200.0, 150.0, 0.0]))
    master = render_master(TARGET, RECIPE.light, camera, pose, samples=64, seed=9)
    image = develop(master.full(camera), RECIPE.sensor)
    truth = camera.project(pose.apply(TARGET.points))
    centroid = outline_centroid(camera.project(pose.apply(TARGET.circle_rim())))
    assert np.linalg.norm(centroid - truth[CIRCLE]) > 0.2
    circle = find_circle(image, BoardMap.fit(truth[:CIRCLE], TARGET.inner), TARGET)
    assert circle is not None
    assert np.linalg.norm(circle.centre_px - truth[CIRCLE]) < 0.05


def test_saddle_fit_is_exact_on_its_own_model():
    from scipy.special import erf

    y, x = np.mgrid[-7:8, -7:8]
    offsets = np.stack((x.ravel(), y.ravel()), axis=1).astype(float)[None]
    corner, normals, blur = np.array([0.31, -0.27]), np.deg2rad([12.0, 97.0]), 0.9
    d = [(offsets[0] - corner) @ [np.cos(a), np.sin(a)] / (np.sqrt(2) * blur) for a in normals]
    patch = 120.0 + 0.4 * offsets[0, :, 0] + 90.0 * erf(d[0]) * erf(d[1])
    start, angles = np.array([[0.8, 0.2]]), np.deg2rad([[20.0, 90.0]])
    fitted = fit_saddles(patch[None], offsets, np.ones((1, 225)), angles, start)
    np.testing.assert_allclose(fitted.points_px[0], corner, atol=1e-4)
    assert fitted.blur_px[0] == pytest.approx(blur, abs=1e-3)


def test_board_map_inverts_itself():
    corners = grid((9, 6)) * [30.0, 28.0] + [100.0, 50.0]
    board = BoardMap.fit(corners, (9, 6))
    np.testing.assert_allclose(board(np.array([[2.5, 3.5]]))[0], [175.0, 148.0], atol=1e-9)
    np.testing.assert_allclose(board.invert(np.array([175.0, 148.0]), np.zeros(2)), [2.5, 3.5], atol=1e-9)

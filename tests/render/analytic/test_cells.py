"""What cells see of the target: cases with an answer that needs no renderer."""

import numpy as np

from eposit import Camera, Pose
from eposit.pose import rotation_from_euler
from render.frame import render_frame
from render.light import Light
from render.targets.chessboard import Chessboard

TARGET, LIGHT = Chessboard(), Light()
CAMERA = Camera(lens="perspective", fx=300.0, fy=301.0, cx=201.3, cy=149.2, width=400, height=300)


def covered(low, high, size):
    """(size,) share of each pixel, [i - 1/2, i + 1/2], that lies between two places, px."""
    pixel = np.arange(size)
    return np.clip(np.minimum(high, pixel + 0.5) - np.maximum(low, pixel - 0.5), 0.0, 1.0)


def test_the_back_of_the_board_is_black_and_hides_the_background():
    """The board turned away from the camera by half a turn: nothing lights its back, and it lets nothing through.

    Its image is an upright rectangle, so that each pixel's share of it is a product of two lengths.
    """
    R = rotation_from_euler(np.array([np.pi, 0.0, 0.0]))
    pose = Pose(R, np.array([20.0, -10.0, 2500.0]) - R @ TARGET.board_centre)
    x0, x1, y0, y1 = TARGET.extent_mm
    ends = CAMERA.project(pose.apply(np.array([[x0, y0, 0.0], [x1, y1, 0.0]])))
    (left, top), (right, bottom) = ends.min(axis=0), ends.max(axis=0)
    board = np.outer(covered(top, bottom, CAMERA.height), covered(left, right, CAMERA.width))
    picture = render_frame(TARGET, LIGHT, CAMERA, pose, samples=64).full(CAMERA)
    # At 400 px a float32 is good to 3e-5 px; in a pixel on the border that is as large a share of the background.
    np.testing.assert_allclose(picture, LIGHT.background * (1.0 - board), atol=1e-4)
    assert np.all(picture[board == 1.0] == 0.0)
    assert np.count_nonzero(board == 1.0) > 10_000

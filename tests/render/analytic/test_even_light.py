"""What pixels see of the target, against rays through many points of each pixel."""

import numpy as np

from eposit import Camera, Pose
from eposit.pose import rotation_from_euler
from render.analytic.even_light import pixel_shares
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region

TARGET = Chessboard()
CAMERA = Camera(lens="equisolid", fx=140.0, fy=141.0, cx=100.3, cy=74.8, width=200, height=150)
RAYS = 16  # along each side of a pixel


def sampled(pose, region):
    """Shares of white and of target by counting; the circle apart."""
    inner = (np.arange(RAYS) + 0.5) / RAYS - 0.5
    x = (region.x + np.arange(region.width))[:, None] + inner
    y = (region.y + np.arange(region.height))[:, None] + inner
    rays = CAMERA.bearing(np.stack(np.meshgrid(x.ravel(), y.ravel()), axis=-1)) @ pose.R
    eye = pose.inverse().t
    hit = [eye[:2] + (z - eye[2]) / rays[..., 2:] * rays[..., :2] for z in (0.0, -TARGET.circle_height_mm)]
    x0, x1, y0, y1 = TARGET.extent_mm
    bx, by = np.moveaxis(hit[0], -1, 0)
    on_board = (bx > x0) & (bx < x1) & (by > y0) & (by < y1)
    column, row = np.floor(bx / TARGET.square_mm) + 1, np.floor(by / TARGET.square_mm) + 1
    squares = (column >= 0) & (column < TARGET.columns) & (row >= 0) & (row < TARGET.rows)
    black = squares & ((column + row) % 2 == 0)
    on_circle = np.linalg.norm(hit[1] - TARGET.circle_centre[:2], axis=-1) < TARGET.circle_radius_mm
    of_circle = (TARGET.circle - TARGET.black) / (TARGET.white - TARGET.black)
    white = np.where(on_circle, of_circle, on_board & ~black)
    return (
        part.astype(float).reshape(region.height, RAYS, region.width, RAYS).mean(axis=(1, 3))
        for part in (white, on_board | on_circle)
    )


def test_shares_are_those_of_many_rays():
    R = rotation_from_euler((0.2, -0.3, 0.4))
    pose, region = Pose(R, np.array([30.0, -20.0, 1600.0]) - R @ TARGET.board_centre), Region(50, 40, 110, 80)
    white, target = sampled(pose, region)
    found = pixel_shares(TARGET, CAMERA, pose, region)
    # 16 x 16 rays tell a share to 1/32 on a slanted edge and a sixteenth on one along the rows, of which there is none.
    for part, other in ((found.white, white), (found.target, target)):
        assert np.abs(part - other).max() < 0.05
        assert np.sqrt(np.mean((part - other) ** 2)) < 0.005
        assert abs(np.mean(part - other)) < 2e-4

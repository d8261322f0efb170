"""Printed boards, flat and bent, in closed form: against rays cast one by one, and against Mitsuba."""

import numpy as np
import pytest

from eposit import Camera, Pose
from eposit.pose import rotation_from_euler
from render import backend
from render.frame import render_frame, render_reference
from render.light import Light, sheet_shading_map
from render.region import target_region
from render.sensor.develop import SensorModel, develop
from render.targets.aprilgrid import AprilGrid
from render.targets.charuco import Charuco
from render.targets.circle_grid import CircleGrid
from render.targets.image_region import Region
from render.targets.plain_chessboard import PlainChessboard
from tests.render.analytic.ray_cast import coverage

CAMERA = Camera(lens="equisolid", fx=180.0, fy=180.5, cx=201.3, cy=149.2, width=400, height=300)
EVEN = Light(ambient_share=1.0, lamp_side_mm=0.1)  # light from everywhere, so that a flat board is lit evenly
BOARDS = [
    Charuco(columns=5, rows=4, square_mm=160.0, marker_mm=120.0),
    Charuco(columns=5, rows=4, square_mm=160.0, marker_mm=120.0, bend_sag_mm=60.0, print_scale=(1.02, 0.97)),
    AprilGrid(columns=4, rows=3, tag_mm=160.0, bend_sag_mm=-30.0, bend_axis="both"),
    CircleGrid(columns=3, rows=7, spacing_mm=110.0, diameter_mm=80.0, bend_sag_mm=-40.0, bend_axis="y"),
    CircleGrid(columns=7, rows=5, asymmetric=False, spacing_mm=110.0, diameter_mm=90.0, print_scale=(1.03, 1.0)),
    PlainChessboard(columns=7, rows=4, square_mm=120.0, margin_mm=0.0, bend_sag_mm=30.0),
]

IN_FULL = [pytest.param(board, marks=pytest.mark.full) for board in BOARDS[1:5]]


def pose(target, tilt=35.0, depth=1000.0):
    R = rotation_from_euler(np.deg2rad([tilt, 0.5 * tilt, 12.0]))
    return Pose(R, np.array([20.0, -10.0, depth]) - R @ target.board_centre)


@pytest.mark.parametrize("target", [BOARDS[0], *IN_FULL, BOARDS[5]])
def test_pixels_are_the_mean_of_rays_cast_one_by_one(target):
    camera = CAMERA.replace(fx=90.0, fy=90.3, cx=101.3, cy=74.2, width=200, height=150)
    found = render_frame(target, EVEN, camera, pose(target), samples=64)
    board, black = coverage(target, camera, pose(target), found.region, 16)
    expected = board + black * (target.black / target.white - 1.0) + EVEN.background * (1.0 - board)
    grey = 255.0 * 0.8 * (found.radiance - expected)
    # An upright edge splits 16 x 16 rays to half a ray's width, of 190 grey levels: 6. Where edges meet there are two.
    assert np.abs(grey).max() < 14.0
    assert np.sqrt(np.mean(grey[black > 0.0] ** 2)) < 2.0
    assert abs(grey.mean()) < 0.02  # edges 0.01 px off would show


@pytest.mark.parametrize("target", BOARDS[1:4])
def test_region_has_the_bits_of_the_whole_picture(target):
    part = render_frame(target, Light(), CAMERA, pose(target), samples=16)
    assert part.region == target_region(target, CAMERA, pose(target))
    assert part.region.width * part.region.height < 0.5 * CAMERA.width * CAMERA.height
    whole = render_frame(
        target, Light(), CAMERA, pose(target), samples=16, region=Region.whole(CAMERA.width, CAMERA.height)
    )
    np.testing.assert_array_equal(part.full(CAMERA), whole.radiance)


def test_one_set_of_kernels_serves_all_printed_boards():
    backend.load()
    dr = backend.jit()

    def kernels(target, where):
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            render_frame(target, Light(), CAMERA, where, samples=16)
            return {kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel}

    first = kernels(BOARDS[0], pose(BOARDS[0]))
    assert len(first) > 3
    for target in BOARDS[1:]:
        assert kernels(target, pose(target, 20.0, 1500.0)) <= first  # with crowded lines no pixel has a single edge


def test_light_on_a_cylinder_follows_its_normals():
    """A lamp so small and far that its irradiance at a place is the cosine there over the squared distance."""
    target = PlainChessboard(bend_sag_mm=40.0)
    light = Light(ambient_share=0.0, lamp_position_mm=(3000.0, -900.0, -5000.0), lamp_side_mm=1.0)
    shading = sheet_shading_map(target, light) * target.white
    x0, x1, y0, y1 = target.sheet.extent_mm
    rows, columns = shading.shape
    lamp, middle = np.array(light.lamp_position_mm), target.board_centre

    def received(point, normal):
        to_lamp = lamp - point
        distance = np.linalg.norm(to_lamp)
        shining = (lamp - middle) @ to_lamp / np.linalg.norm(lamp - middle) / distance  # the lamp faces the middle
        return normal @ to_lamp / distance**3 * shining

    for row, column in ((0, 0), (99, 3), (150, 199)):
        at = np.array([x0 + (column + 0.5) * (x1 - x0) / columns, y0 + (row + 0.5) * (y1 - y0) / rows])
        angle = (at[0] - middle[0]) * target.sheet.curvatures[0]
        normal = np.array([np.sin(angle), 0.0, -np.cos(angle)])
        expected = received(target.sheet.lift(at), normal) / received(middle, np.array([0.0, 0.0, -1.0]))
        assert shading[row, column] == pytest.approx(expected, rel=1e-6)  # a lamp of 1 mm at 5 m


@pytest.mark.slow
@pytest.mark.parametrize("target", BOARDS)
def test_developed_picture_is_that_of_path_traced_rays(target):
    """No pixel off by more than two grey levels, and the mean by less than 0.05."""
    ours = render_frame(target, Light(), CAMERA, pose(target), samples=64)
    theirs = render_reference(target, Light(), CAMERA, pose(target), samples=1024, seed=2)
    a, b = (develop(master.full(CAMERA), SensorModel()).astype(int) for master in (ours, theirs))
    linear = 255.0 * 0.8 * (ours.radiance - theirs.radiance)
    print(
        f"{type(target).__name__}: grey levels max {np.abs(a - b).max()}, mean {np.mean(a - b):+.4f}; before the point "
        f"spread max {np.abs(linear).max():.2f}, rms {np.sqrt(np.mean(linear**2)):.3f}, mean {linear.mean():+.4f}"
    )
    assert np.abs(a - b).max() <= 2
    assert abs(np.mean(a - b)) < 0.05

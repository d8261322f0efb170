"""Rendering: regions, bits, the looked-up light against Mitsuba's own, files."""

import dataclasses

import numpy as np
import pytest

from datasets.store.images import decode_png, encode_png
from datasets.store.linear_images import LinearImageError, read_linear, write_linear
from eposit import Camera, Pose
from eposit.pose import rotation_from_euler
from render import backend
from render.analytic.image_circle import lens_coverage
from render.frame import render_frame, render_reference
from render.light import Light
from render.region import target_region
from render.sensor.develop import SensorModel, develop
from render.targets.chessboard import Chessboard
from render.targets.disc_shade import blocked_share
from render.targets.image_region import Region

TARGET, LIGHT = Chessboard(), Light()
CAMERA = Camera(lens="orthogonal", fx=180.0, fy=180.5, cx=201.3, cy=149.2, width=400, height=300)


def pose(tilt=35.0, depth=1300.0):
    R = rotation_from_euler(np.deg2rad([tilt, 0.5 * tilt, 12.0]))
    return Pose(R, np.array([20.0, -10.0, depth]) - R @ TARGET.board_centre)


@pytest.mark.parametrize("camera", [CAMERA, CAMERA.replace(lens="perspective", fx=300.0, fy=301.0)])
def test_region_has_the_bits_of_the_whole_picture(camera):
    region = target_region(TARGET, camera, pose())
    part = render_frame(TARGET, LIGHT, camera, pose(), samples=16)
    assert part.region == region
    assert region[2] * region[3] < 0.8 * camera.width * camera.height
    whole = render_frame(TARGET, LIGHT, camera, pose(), samples=16, region=Region.whole(camera.width, camera.height))
    np.testing.assert_array_equal(part.full(camera), whole.radiance)


def test_nothing_is_random():
    first = render_frame(TARGET, LIGHT, CAMERA, pose(), samples=16).radiance
    render_frame(TARGET, LIGHT, CAMERA, pose(50.0), samples=64)
    np.testing.assert_array_equal(first, render_frame(TARGET, LIGHT, CAMERA, pose(), samples=16).radiance)


@pytest.mark.parametrize(("lens", "focal"), [("orthogonal", 180.0), ("kannala_brandt", 180.0), ("perspective", 300.0)])
@pytest.mark.parametrize(("tilt", "depth"), [(0.0, 2500.0), (35.0, 1300.0), (72.0, 1300.0), (10.0, 650.0)])
def test_standard_cells_give_the_mean_of_the_pixel(lens, focal, tilt, depth):
    """64 cells in the pixels that edges cross, and fewer elsewhere, against 64 cells of each of 64 parts of a pixel."""
    k = (-0.04, 0.003, -0.0004, 0.00002) if lens == "kannala_brandt" else ()
    camera = CAMERA.replace(lens=lens, fx=focal, fy=focal + 0.5, coefficients=k)
    ours = render_frame(TARGET, LIGHT, camera, pose(tilt, depth), samples=64)
    # Eight times the resolution: its pixels are parts of ours, and all of its edges are its own.
    cx, cy = (8.0 * c + 3.5 for c in (camera.cx, camera.cy))
    fine_camera = camera.replace(fx=8 * camera.fx, fy=8 * camera.fy, cx=cx, cy=cy, width=3200, height=2400)
    region = Region(*(8 * value for value in ours.region))
    fine = render_frame(TARGET, LIGHT, fine_camera, pose(tilt, depth), samples=64, region=region)
    mean = fine.radiance.reshape(ours.region.height, 8, ours.region.width, 8).mean(axis=(1, 3), dtype=np.float64)
    grey = 255.0 * 0.8 * np.abs(ours.radiance - mean)
    # Where edges meet within a cell of 1/64 pixel, their product may be wrong by a third of it: 0.3 / 64 of 150 grey
    # levels in each such cell, of which a pixel of a steep board has two or three. A missed edge shows as 10 and more.
    assert grey.max() < 1.5
    assert grey.mean() < 0.01  # light bends over a pixel


def test_looked_up_light_is_mitsubas_light():
    ours = render_frame(TARGET, LIGHT, CAMERA, pose(), samples=64)
    theirs = render_reference(TARGET, LIGHT, CAMERA, pose(), samples=256, seed=2)
    difference = 255.0 * 0.8 * (ours.radiance - theirs.radiance)
    # 256 x 4 lamp samples leave 0.7 grey levels in a white pixel, more at an edge, and 0.005 in the mean of 25000.
    assert abs(difference.mean()) < 0.03
    assert np.quantile(np.abs(difference), 0.999) < 8.0
    assert np.sqrt(np.mean(difference**2)) < 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lens", "focal", "tilt", "depth"),
    [
        ("perspective", 300.0, 35.0, 1300.0),
        ("perspective", 300.0, 65.0, 1300.0),
        ("orthogonal", 180.0, 35.0, 1300.0),
        ("orthogonal", 180.0, 72.0, 1300.0),
        ("equidistance", 180.0, 0.0, 2500.0),
        ("equidistance", 180.0, 10.0, 650.0),
    ],
)
def test_developed_picture_is_that_of_4096_path_traced_rays(lens, focal, tilt, depth):
    """No pixel off by more than one grey level, and the mean by less than 0.05."""
    camera = CAMERA.replace(lens=lens, fx=focal, fy=focal + 0.5)
    ours = render_frame(TARGET, LIGHT, camera, pose(tilt, depth), samples=64)
    theirs = render_reference(TARGET, LIGHT, camera, pose(tilt, depth), samples=4096, seed=2)
    a, b = (develop(master.full(camera), SensorModel()).astype(int) for master in (ours, theirs))
    linear = 255.0 * 0.8 * (ours.radiance - theirs.radiance)
    worst = np.unravel_index(np.argmax(np.abs(linear)), linear.shape)
    print(
        f"{lens} tilt {tilt:g} depth {depth:g}: grey levels max {np.abs(a - b).max()}, mean {np.mean(a - b):+.4f}, "
        f"off by one {np.mean(a != b):.2%}; before the point spread max {np.abs(linear).max():.2f}, "
        f"rms {np.sqrt(np.mean(linear**2)):.3f}, mean {linear.mean():+.4f}, worst {worst} of {ours.region}"
    )
    assert np.abs(a - b).max() <= 1
    assert abs(np.mean(a - b)) < 0.05


def test_blocked_share_far_and_below():
    # Straight below the centre a disc of radius r at height h fills r^2 / (r^2 + h^2) of the hemisphere's light.
    assert blocked_share(np.zeros(1), 30.0, 10.0)[0] == pytest.approx(900.0 / 1000.0, rel=1e-12)
    assert blocked_share(np.array([1e5]), 30.0, 10.0)[0] < 1e-9


def test_pixels_outside_the_image_circle_are_black():
    coverage = lens_coverage(CAMERA)
    assert coverage[150, 201] == 1.0
    assert coverage[0, 0] == 0.0
    # The circle's area in pixels, where it does not reach the border: here it is cut at top and bottom.
    y = np.arange(300) - CAMERA.cy
    chord = 2 * CAMERA.fx * np.sqrt(np.maximum(0.0, 1.0 - (y / CAMERA.fy) ** 2))
    assert coverage.sum() == pytest.approx(chord.sum(), rel=1e-3)
    picture = render_frame(TARGET, LIGHT, CAMERA, pose(), samples=4).full(CAMERA)
    assert picture[0, 0] == 0.0
    assert picture[150, 60] == pytest.approx(LIGHT.background)


def test_exr_round_trip_with_data_window(tmp_path, capfd):
    import OpenEXR

    master = render_frame(TARGET, LIGHT, CAMERA, pose(), samples=4)
    path = tmp_path / "frame.exr"
    write_linear(master, CAMERA, path, "key")
    back = read_linear(path, "key")
    np.testing.assert_array_equal(back.radiance, master.radiance)
    assert back.region == master.region
    header = OpenEXR.File(str(path)).header()
    assert tuple(header["displayWindow"][1]) == (CAMERA.width - 1, CAMERA.height - 1)
    assert tuple(header["dataWindow"][0]) == master.region[:2]
    with pytest.raises(LinearImageError, match="another frame"):
        read_linear(path, "other key")
    whole = path.read_bytes()
    for kept in (200, len(whole) // 2):  # within the header, and within the pixels
        path.write_bytes(whole[:kept])
        with pytest.raises(LinearImageError, match="cannot be read"):
            read_linear(path, "key")
    assert capfd.readouterr() == ("", "")


def test_develop_spreads_exposes_and_rounds():
    picture = np.zeros((41, 41), np.float32)
    picture[20, 20] = 1.0
    model = SensorModel(exposure=100.0, psf_sigma_px=1.2)
    grey = develop(picture, model).astype(float)
    y, x = np.mgrid[-20:21, -20:21]
    expected = np.exp(-(x**2 + y**2) / (2 * 1.2**2))
    expected = np.clip(100.0 * expected / expected.sum(), 0, 1) * 255
    assert np.abs(grey - expected).max() <= 0.51  # rounding is half a grey level
    flat = np.full((9, 9), 0.5, np.float32)
    assert np.all(develop(flat, SensorModel(exposure=1.0)) == 128)
    assert np.all(develop(flat, SensorModel(exposure=1.0, gamma=2.2)) == round(255 * 0.5 ** (1 / 2.2)))
    assert np.all(develop(flat * 10, SensorModel()) == 255)


def test_png_round_trip_and_refusal():
    image = np.random.default_rng(0).integers(0, 256, (20, 30)).astype(np.uint8)
    np.testing.assert_array_equal(decode_png(encode_png(image)), image)
    for data in (b"", b"not a picture"):
        with pytest.raises(ValueError, match="not an 8-bit PNG, grey or in colour"):
            decode_png(data)


def test_target_geometry():
    np.testing.assert_array_equal(TARGET.circle_centre, [-50.0, 50.0, -10.0])
    np.testing.assert_array_equal(TARGET.corners[[0, 8, 53]], [[0, 0, 0], [800, 0, 0], [800, 500, 0]])
    assert TARGET.reflectance()[1, 1] == np.float32(TARGET.black)  # the first square, inside one ring of margin
    assert TARGET.index("circle") == 54
    assert TARGET.index((8, 5)) == 53
    small = dataclasses.replace(TARGET, columns=5, rows=4, circle_height_mm=50.0)
    assert small.inner == (4, 3)


def test_a_new_pose_region_or_camera_compiles_nothing():
    backend.load()
    dr = backend.jit()

    def kernels(camera, where):
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            render_frame(TARGET, LIGHT, camera, where, samples=16)
            return {kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel}

    first = kernels(CAMERA, pose())
    assert len(first) > 3
    assert kernels(CAMERA, pose(50.0, 1900.0)) == first
    assert kernels(CAMERA.replace(fx=150.0, cx=170.0, width=380), pose(20.0)) == first

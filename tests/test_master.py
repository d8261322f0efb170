"""Rendering: regions, bits, the looked-up light against Mitsuba's own, files."""

import dataclasses

import numpy as np
import pytest

from eposit import Camera, Pose
from eposit.pose import rotation_from_euler
from render.develop import SensorModel, decode_png, develop, encode_png
from render.light import Light, blocked_share, lamp_irradiance
from render.master import (
    MasterError,
    edge_pixels,
    lens_coverage,
    read_master,
    render_master,
    target_region,
    write_master,
)
from render.target import Target

TARGET, LIGHT = Target(), Light()
CAMERA = Camera(lens="orthogonal", fx=180.0, fy=180.5, cx=201.3, cy=149.2, width=400, height=300)


def pose(tilt=35.0, depth=1300.0):
    R = rotation_from_euler(np.deg2rad([tilt, 0.5 * tilt, 12.0]))
    return Pose(R, np.array([20.0, -10.0, depth]) - R @ TARGET.board_centre)


@pytest.mark.parametrize("camera", [CAMERA, CAMERA.replace(lens="perspective", fx=300.0, fy=301.0)])
def test_region_has_the_bits_of_the_whole_picture(camera):
    region = target_region(TARGET, camera, pose())
    part = render_master(TARGET, LIGHT, camera, pose(), samples=16, seed=5)
    assert part.region == region
    assert region[2] * region[3] < 0.8 * camera.width * camera.height
    whole = render_master(TARGET, LIGHT, camera, pose(), samples=16, seed=5, region=(0, 0, camera.width, camera.height))
    np.testing.assert_array_equal(part.full(camera), whole.radiance)


def test_the_seed_decides_the_bits():
    first, again, other = (render_master(TARGET, LIGHT, CAMERA, pose(), samples=16, seed=s).radiance for s in (7, 7, 8))
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)


def test_few_samples_suffice_where_no_edge_is():
    """All pixels at the full number of samples differ from ours by less than a tenth of a grey level."""
    spread = render_master(TARGET, LIGHT, CAMERA, pose(), samples=256, seed=1)
    edges = edge_pixels(TARGET, LIGHT, CAMERA, pose(), spread.region)
    reference = render_master(TARGET, LIGHT, CAMERA, pose(), samples=4096, seed=2)
    grey = 255.0 * 0.8 * np.abs(spread.radiance - reference.radiance)
    assert edges.mean() < 0.6
    # Shading bends by 0.1 grey level over a pixel at most; an edge that was missed shows as 10 and more.
    assert grey[~edges].max() < 0.25


def test_looked_up_light_is_mitsubas_light():
    ours = render_master(TARGET, LIGHT, CAMERA, pose(), samples=1024, seed=1)
    theirs = render_master(TARGET, LIGHT, CAMERA, pose(), samples=1024, seed=2, reference=True)
    difference = 255.0 * 0.8 * (ours.radiance - theirs.radiance)
    # 1024 x 4 lamp samples leave 0.3 grey levels in a pixel and 0.001 in the mean of 1e5; the smooth map and its
    # quadrature are good to 0.1.
    assert abs(difference.mean()) < 0.1
    assert np.quantile(np.abs(difference), 0.999) < 3.0
    assert np.sqrt(np.mean(difference**2)) < 0.6


def test_lamp_irradiance_is_the_polygon_formula():
    """Lambert's closed form for a polygon of unit radiance, from Baum et al. 1989."""
    points = np.array([[0.0, 0.0, 0.0], [400.0, 250.0, 0.0], [900.0, 600.0, 0.0]])
    found = lamp_irradiance(TARGET, LIGHT, points, 48, shadowed=False)
    for point, value in zip(points, found, strict=True):
        corners = LIGHT.lamp_corners(TARGET) - point
        unit = corners / np.linalg.norm(corners, axis=1, keepdims=True)
        total = np.zeros(3)
        for a, b in zip(unit, np.roll(unit, -1, axis=0), strict=True):
            cross = np.cross(a, b)
            total += np.arccos(a @ b) * cross / np.linalg.norm(cross)
        # Midpoint rule, 48^2 points on 0.31 rad: (0.31 / 48)^2 / 24 times the bend of cos^4 on both axes, 8: 1.4e-5.
        assert value == pytest.approx(abs(0.5 * total @ [0, 0, -1]), rel=3e-5)


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
    picture = render_master(TARGET, LIGHT, CAMERA, pose(), samples=4, seed=0).full(CAMERA)
    assert picture[0, 0] == 0.0
    assert picture[150, 60] == pytest.approx(LIGHT.background)


def test_exr_round_trip_with_data_window(tmp_path, capfd):
    import OpenEXR

    master = render_master(TARGET, LIGHT, CAMERA, pose(), samples=4, seed=0)
    path = tmp_path / "frame.exr"
    write_master(master, CAMERA, path, "key")
    back = read_master(path, "key")
    np.testing.assert_array_equal(back.radiance, master.radiance)
    assert back.region == master.region
    header = OpenEXR.File(str(path)).header()
    assert tuple(header["displayWindow"][1]) == (CAMERA.width - 1, CAMERA.height - 1)
    assert tuple(header["dataWindow"][0]) == master.region[:2]
    with pytest.raises(MasterError, match="another frame"):
        read_master(path, "other key")
    whole = path.read_bytes()
    for kept in (200, len(whole) // 2):  # within the header, and within the pixels
        path.write_bytes(whole[:kept])
        with pytest.raises(MasterError, match="cannot be read"):
            read_master(path, "key")
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
        with pytest.raises(ValueError, match="not an 8-bit grey PNG"):
            decode_png(data)


def test_target_geometry():
    np.testing.assert_array_equal(TARGET.circle_centre, [-50.0, 50.0, -10.0])
    np.testing.assert_array_equal(TARGET.corners[[0, 8, 53]], [[0, 0, 0], [800, 0, 0], [800, 500, 0]])
    assert TARGET.reflectance()[1, 1] == np.float32(TARGET.black)  # the first square, inside one ring of margin
    assert TARGET.index("circle") == 54
    assert TARGET.index((8, 5)) == 53
    small = dataclasses.replace(TARGET, columns=5, rows=4, circle_height_mm=50.0)
    assert small.inner == (4, 3)

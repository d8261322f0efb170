"""The sheet: scaled and bent print against geometry worked out in another way."""

import numpy as np
import pytest

from render.targets.sheet import Sheet

EXTENT = (-150.0, 950.0, -120.0, 640.0)
SHEETS = [
    Sheet(EXTENT, sag_mm=20.0, axis="x"),
    Sheet(EXTENT, scale=(1.001, 0.998), sag_mm=-35.0, axis="y"),
    Sheet(EXTENT, scale=(0.99, 1.02), sag_mm=20.0, axis="both"),
    Sheet(EXTENT, scale=(0.99, 1.02)),
]


def places(count=400):
    rng = np.random.default_rng(3)
    return rng.uniform(EXTENT[::2], EXTENT[1::2], (count, 2))


@pytest.mark.parametrize("sheet", SHEETS)
def test_borders_lie_behind_the_middle_by_the_sag(sheet):
    x0, x1, y0, y1 = sheet.extent_mm
    middle = np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1)])
    np.testing.assert_allclose(sheet.lift(middle), [*(middle * sheet.scale), 0.0], atol=1e-9)
    ends = {"x": [(x0, middle[1]), (x1, y0)], "y": [(middle[0], y1), (x0, y0)], "both": [(x0, y0), (x1, middle[1])]}
    np.testing.assert_allclose(sheet.lift(np.array(ends[sheet.axis]))[:, 2], sheet.sag_mm, atol=1e-8)


@pytest.mark.parametrize("sheet", SHEETS)
def test_normals_are_those_of_the_surface(sheet):
    at, step = places(), 1e-3
    along_x, along_y = (sheet.lift(at + d) - sheet.lift(at - d) for d in step * np.eye(2))
    normal = np.cross(along_y, along_x)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    np.testing.assert_allclose(sheet.normals(at), normal, atol=1e-8)  # differences of 1e-3 mm lose six digits
    assert np.all(sheet.normals(at)[:, 2] < 0.0)


@pytest.mark.parametrize("sheet", SHEETS[:2])
def test_a_cylinder_keeps_lengths(sheet):
    """A line on the print, walked along in steps of a hundredth of a millimetre, is as long as it was drawn."""
    share = np.linspace(0.0, 1.0, 100_001)[:, None]
    ends = np.array([[EXTENT[0], EXTENT[2]], [EXTENT[1], EXTENT[3]]])
    line = sheet.lift(ends[0] + share * (ends[1] - ends[0]))
    length = np.sum(np.linalg.norm(np.diff(line, axis=0), axis=1))
    assert length == pytest.approx(np.linalg.norm((ends[1] - ends[0]) * sheet.scale), rel=1e-9)


def test_a_bowl_stretches_as_little_as_it_says():
    sheet, at, step = SHEETS[2], places(), 1e-3
    for axis in range(2):
        d = step * np.eye(2)[axis]
        length = np.linalg.norm(sheet.lift(at + d) - sheet.lift(at - d), axis=1) / (2.0 * step * sheet.scale[axis])
        assert np.all(length >= 1.0 - 1e-9)
        assert length.max() <= 1.0 + 2.0 * (sheet.sag_mm / sheet.half_sides[axis]) ** 2


@pytest.mark.parametrize(
    ("sheet", "match"),
    [
        (Sheet(EXTENT, scale=(0.1, 1.0)), "print_scale"),
        (Sheet(EXTENT, sag_mm=138.0), "bend_sag_mm is 138.0; .* -137.5 to 137.5 mm"),
        (Sheet(EXTENT, sag_mm=np.nan), "bend_sag_mm"),
        (Sheet(EXTENT, sag_mm=-96.0, axis="both"), "-95 to 95 mm"),
    ],
)
def test_impossible_sheets_are_refused(sheet, match):
    with pytest.raises(ValueError, match=match):
        sheet.check("target")

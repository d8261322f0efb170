"""Frames: points where they were found, arrows along the errors, one scale for both sides."""

import re

import numpy as np
import pytest

from pipelines.nightly.page.pictures import Marks, drawn
from tests.pipelines.nightly.page import synthetic


def _arrows(inside):
    path = re.search('class="arrow" d="([^"]*)"', inside)[1]
    return np.array(
        [list(map(float, found)) for found in re.findall(r"M([\d.-]+) ([\d.-]+)L([\d.-]+) ([\d.-]+)", path)]
    )


def test_arrows_are_the_enlarged_errors_on_both_sides():
    picture = synthetic.pictures(2)[0]
    found = drawn(picture)
    for (_, inside, _), side in zip(found.sides, (picture.old, picture.new), strict=True):
        arrows = _arrows(inside)
        assert arrows[:, :2] == pytest.approx(side.points_px - picture.corner + 0.5, abs=0.051)  # one decimal
        assert arrows[:, 2:] - arrows[:, :2] == pytest.approx(found.enlarged * side.residuals_px, abs=0.11)
    length = float(re.search(r'class="rod" d="M[\d.]+ [\d.]+h([\d.]+)"', found.rod)[1])
    assert length == pytest.approx(found.bar_px * found.enlarged, abs=0.051)


def test_what_was_found_is_told():
    lost = drawn(synthetic.pictures(1)[0])
    assert [told for *_, told in lost.sides][1] == "nothing found"
    assert lost.sides[0][2].startswith("63 of 63 points, RMS 0.0072 px, largest 0.015 px")
    assert not _arrows(lost.sides[1][1]).size


def test_exact_points_and_points_without_truth_are_drawn():
    picture = synthetic.pictures(1)[0]
    points = picture.old.points_px
    for residuals in (np.zeros(points.shape), np.full(points.shape, np.nan)):
        marks = Marks(points, residuals)
        found = drawn(type(picture)(**{**_fields(picture), "old": marks, "new": marks}))
        assert found.enlarged == 1.0
        assert "nan" not in found.sides[0][1]


def _fields(picture):
    return {name: getattr(picture, name) for name in picture.__dataclass_fields__}


@pytest.mark.parametrize("shape", [(1, 1), (40, 2000), (3000, 20)])
def test_any_crop_becomes_a_picture(shape):
    picture = synthetic.pictures(1)[0]
    found = drawn(type(picture)(**{**_fields(picture), "crop": np.zeros(shape, np.uint8)}))
    assert found.image.startswith("data:image/jpeg;base64,/9j/")
    assert (found.height, found.width) == shape

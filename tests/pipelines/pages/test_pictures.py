"""Frames: points where they were found, arrows along the errors, one scale for both sides."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pipelines.pages.pictures import SMALL_PX, Marks, drawn
from tests.pipelines.nightly.page import synthetic


def _arrows(inside):
    path = re.search('class="arrow" d="([^"]*)"', inside)[1]
    return np.array(
        [list(map(float, found)) for found in re.findall(r"M([\d.-]+) ([\d.-]+)L([\d.-]+) ([\d.-]+)", path)]
    )


def test_arrows_are_the_enlarged_errors_on_both_sides():
    picture = synthetic.pictures(2)[0]
    found = drawn(picture)
    for one, side in zip(found.sides, picture.sides, strict=True):
        arrows = _arrows(one.marks)
        assert arrows[:, :2] == pytest.approx(side.marks.points_px - picture.corner + 0.5, abs=0.051)  # one decimal
        assert arrows[:, 2:] - arrows[:, :2] == pytest.approx(found.enlarged * side.marks.residuals_px, abs=0.11)
    length = float(re.search(r'class="rod" d="M[\d.]+ [\d.]+h([\d.]+)"', found.rod)[1])
    assert length == pytest.approx(found.bar_px * found.enlarged, abs=0.051)


def test_what_was_found_is_told():
    lost = drawn(synthetic.pictures(1)[0])
    assert lost.sides[1].told == "nothing found"
    assert lost.sides[0].told.startswith("63 of 63 points, RMS 0.0072 px, largest 0.015 px")
    assert not _arrows(lost.sides[1].marks).size


def test_an_image_is_stored_once_and_reduced_to_what_is_asked():
    picture = synthetic.pictures(1)[0]
    small, large = drawn(picture), drawn(picture, 2 * SMALL_PX)
    assert small.sides[0].image
    assert not small.sides[1].image
    assert len(small.sides[0].image) < len(large.sides[0].image)


def test_exact_points_and_points_without_truth_are_drawn():
    picture = synthetic.pictures(1)[0]
    first = picture.sides[0]
    for residuals in (np.zeros(first.marks.points_px.shape), np.full(first.marks.points_px.shape, np.nan)):
        found = drawn(replace(picture, sides=(replace(first, marks=Marks(first.marks.points_px, residuals)),)))
        assert found.enlarged == 1.0
        assert "nan" not in found.sides[0].marks


def test_images_without_marks_have_no_scale():
    picture = synthetic.pictures(1)[0]
    found = drawn(replace(picture, sides=(replace(picture.sides[0], marks=None, told="white: 3 or more"),)))
    assert (found.rod, found.sides[0].marks, found.sides[0].told) == ("", "", "white: 3 or more")


@pytest.mark.parametrize("shape", [(1, 1), (40, 2000), (3000, 20)])
def test_any_crop_becomes_a_picture(shape):
    picture = synthetic.pictures(1)[0]
    sides = (replace(picture.sides[0], image=np.zeros(shape, np.uint8)), picture.sides[1])
    found = drawn(replace(picture, sides=sides))
    assert found.sides[0].image.startswith("data:image/jpeg;base64,/9j/")
    assert (found.height, found.width) == shape

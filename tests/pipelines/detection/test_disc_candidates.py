"""Blobs that may be discs of a grid: of every size, side by side, and so many at most."""

import cv2
import numpy as np

from pipelines.detection import disc_candidates
from pipelines.detection.disc_candidates import Blobs, groups_of_blobs, levels_of_blobs

RNG = np.random.default_rng(0)


def discs(centres, radius, width, height, blur=0.8):
    image = np.full((height, width), 200, np.uint8)
    for x, y in centres:
        cv2.circle(image, (x, y), radius, 20, -1, cv2.LINE_AA)
    return cv2.GaussianBlur(image, (0, 0), blur)


def test_discs_of_every_size_are_seen_at_some_level_at_their_place_and_of_their_size():
    """Half a pixel of a picture reduced by eight is 3.5 px: taking pixels' centres for their corners would show."""
    for radius in (3, 10, 40, 90):
        centre, side = np.array([260, 270]), 2.0 * radius
        seen = [blobs for blobs in levels_of_blobs(discs([centre], radius, 520, 560)) if len(blobs.points)]
        assert seen
        for blobs in seen:
            assert np.linalg.norm(blobs.points - centre, axis=1).min() < 2.0
        sizes = np.concatenate([blobs.sizes for blobs in seen])
        assert np.abs(sizes - side).min() < 0.2 * side + 1.0  # blur and threshold widen small ones


def test_discs_side_by_side_are_not_one_blob():
    """Blur of 2 px leaves a third of the contrast in a gap of 4 px."""
    centres = [(40 + 16 * k, 60) for k in range(8)]
    blobs = list(levels_of_blobs(discs(centres, 6, 200, 120, blur=2.0)))[-1]
    assert len(blobs.points) == len(centres)


def test_stripes_and_large_things_are_no_discs():
    stripes = np.tile(np.where(np.arange(300) % 20 < 10, 30, 200).astype(np.uint8), (200, 1))
    assert not any(len(blobs.points) for blobs in levels_of_blobs(stripes))


def test_of_too_many_blobs_the_darkest_are_kept(monkeypatch):
    monkeypatch.setattr(disc_candidates, "MOST_BLOBS", 12)
    noise = RNG.integers(150, 250, (400, 600)).astype(np.uint8)
    centres = [(100 + 60 * i, 100 + 60 * j) for i in range(4) for j in range(3)]
    for x, y in centres:
        cv2.circle(noise, (x, y), 6, 10, -1)
    blobs = list(levels_of_blobs(noise))[-1]
    assert blobs.searched == 12 < len(blobs.points)
    assert {tuple(np.rint(point).astype(int)) for point in blobs.points[:12]} == set(centres)


def test_blobs_within_an_outline_are_counted_but_for_those_of_other_sizes():
    discs = np.stack(np.meshgrid(np.arange(5.0), np.arange(4.0)), axis=-1).reshape(-1, 2) * 20.0
    others = np.array([[30.0, 30.0], [50.0, 30.0], [-30.0, 30.0], [10.0, 70.0]])  # two within
    sizes = np.concatenate((np.full(20, 8.0), [8.0, 3.0, 8.0, 8.0]))
    assert Blobs(np.concatenate((discs, others)), sizes, 20).inside(discs) == 21


def test_blobs_are_grouped_with_neighbours_of_their_size_and_the_smaller_group_comes_first():
    grid = np.stack(np.meshgrid(np.arange(6.0), np.arange(5.0)), axis=-1).reshape(-1, 2) * 20.0
    row = np.stack((np.arange(14.0) * 20.0, np.full(14, 500.0)), axis=1)
    large = np.array([[30.0, 45.0], [70.0, 25.0]])  # in the grid, of other sizes
    points, sizes = np.concatenate((grid, row, large)), np.repeat([10.0, 30.0], [44, 2])
    groups = groups_of_blobs(Blobs(points, sizes, len(points)), 2.0, 10)
    assert [len(group) for group in groups] == [14, 30]
    np.testing.assert_array_equal(groups[1], grid)
    assert [len(group) for group in groups_of_blobs(Blobs(points, sizes, len(points)), 2.0, 20)] == [30]


def test_pictures_of_any_size_are_looked_at():
    for shape in ((1, 1), (2, 300), (7, 7), (65, 64)):
        assert all(len(blobs.points) == 0 for blobs in levels_of_blobs(np.full(shape, 90, np.uint8)))

"""Blobs that may be discs of a grid: so many at most, and a grid among clutter is not lost."""

import cv2
import numpy as np

from pipelines.detection import circle_grids
from pipelines.detection.disc_candidates import MOST_BLOBS, MOST_PIXELS, find_blobs, likely_discs
from render.targets.circle_grid import CircleGrid

GRID = CircleGrid()
RNG = np.random.default_rng(0)


def drawn(spacing, width, height, clutter=0):
    """Picture of the grid at the top left, and small blobs to its right and below it; and where its discs are."""
    image = np.full((height, width), 200, np.uint8)
    centres = np.round(spacing * (GRID.pattern_points / GRID.spacing_mm + 1.5))
    for x, y in centres.astype(int):
        cv2.circle(
            image, (int(x), int(y)), round(0.5 * spacing * GRID.diameter_mm / GRID.spacing_mm), 20, -1, cv2.LINE_AA
        )
    away = centres.max(axis=0) + 3 * spacing
    for x, y in RNG.uniform(8, (width - 8, height - 8), (clutter, 2)):
        if x > away[0] or y > away[1]:
            cv2.circle(image, (int(x), int(y)), 3, 20, -1, cv2.LINE_AA)
    return cv2.GaussianBlur(image, (0, 0), 0.8), centres


def test_a_grid_among_a_thousand_blobs_is_found():
    image, centres = drawn(24, 1200, 900, clutter=1500)
    blobs = find_blobs(image)
    assert len(blobs.points) > 2 * MOST_BLOBS
    seen = circle_grids.find_circle_grid(image, GRID)
    assert seen is not None
    assert np.linalg.norm(seen.points_px - centres, axis=1).max() < 0.5  # another disc is 34 px away


def test_a_large_picture_is_reduced_and_its_grid_is_where_it_was():
    image, centres = drawn(120, 3000, 2600)
    assert image.size > 4 * MOST_PIXELS
    seen = circle_grids.find_circle_grid(image, GRID)
    assert seen is not None
    # Half a pixel of the reduced picture is 1.5 px: taking pixels' centres for their corners would show.
    assert np.abs(np.mean(seen.points_px - centres, axis=0)).max() < 0.3


def test_noise_gives_opencv_a_bounded_number_of_dots(monkeypatch):
    """Its search takes time as their cube; no time is asserted, it depends on the machine."""
    searched = []

    def search(picture, *_args, **_options):
        searched.append(cv2.connectedComponents(255 - picture)[0] - 1)
        return False, None

    noise = cv2.resize(RNG.integers(0, 256, (250, 375), np.uint8), (1500, 1000), interpolation=cv2.INTER_CUBIC)
    monkeypatch.setattr(circle_grids.cv2, "findCirclesGrid", search)
    count = GRID.columns * GRID.rows
    assert len(find_blobs(noise).points) > 4 * MOST_BLOBS
    assert circle_grids.find_circle_grid(noise, GRID) is None
    assert all(number <= MOST_BLOBS for number in searched)
    # The likeness of neighbours asks for the discs' own distance: of blobs that lie as close as noise's, some pass.
    assert len(likely_discs(find_blobs(noise), count, 1.0)) <= MOST_BLOBS

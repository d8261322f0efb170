"""How near corners come to what their pixels hold, by the size of the squares: `docs/evidence/corner-bound.md`."""

import datetime
from pathlib import Path

import numpy as np
import pytest

from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.corner_sites import REACH, CornerSites
from pipelines.detection.corners import refine_corners
from pipelines.machine import versions
from tests.supersampled import digitised, picture, side

PLACE = Path(__file__).parents[3] / "docs" / "evidence" / "corner-bound.md"
SIDES = (20, 50, 100, 185)  # of the squares, px
INNER = (5, 4)
ANGLE, BLUR, MEAN, CONTRAST, NOISE = np.deg2rad(17.0), 0.7, 110.0, 85.0, 2.0
CELLS, DRAWS = 4, 8
WINDOW_PX = 10  # that of a fit whose window does not follow the squares
STEPS = np.array([0.05, 0.05, 1e-3, 1e-3, 0.02, 1.0, 1.0, 1e-4, 1e-4])
# 320 numbers tell a ratio to 0.04. The fit reads a band beside the edges, not all of a square, and stops half a
# deviation from the least.
MOST_RATIO = 1.25


def lines(square_px):
    """(2, 2) px for a square along x and along y."""
    return square_px * np.array([[np.cos(ANGLE), -np.sin(ANGLE)], [np.sin(ANGLE), np.cos(ANGLE)]])


def board(square_px):
    """Grey values of a chessboard without an end, and where its corners are."""
    to_px, half = lines(square_px), (np.array(INNER) - 1.0) / 2.0
    size = np.ceil(np.abs(to_px) @ (half + 1.2)).astype(int)
    middle = size + np.array([0.37, 0.21])
    back = np.linalg.inv(to_px)

    def grey(x, y):
        u, v = (back[k, 0] * (x - middle[0]) + back[k, 1] * (y - middle[1]) + half[k] for k in range(2))
        signs = [side(np.arcsin(np.sin(np.pi * w)) / np.pi * square_px, CELLS) for w in (u, v)]
        return MEAN + CONTRAST * signs[0] * signs[1]

    image = picture(grey, *(2 * size + 1), BLUR, CELLS)
    return image, middle + (grid(INNER) - half) @ to_px.T


def corner(p, half_px):
    """Grey values around a corner. p: its place, px from the middle, two normals, blur, mean, contrast, light."""

    def grey(x, y):
        x, y = x - half_px - p[0], y - half_px - p[1]
        signs = [side(np.cos(a) * x + np.sin(a) * y, CELLS) for a in p[2:4]]
        return (p[5] + p[6] * signs[0] * signs[1]) * (1.0 + p[7] * x + p[8] * y)

    return picture(grey, 2 * half_px + 1, 2 * half_px + 1, p[4], CELLS)


def bound(square_px, within):
    """RMS per axis, px, that the pixels of a corner allow. within: of px from it, which pixels are used."""
    half = int(np.ceil(REACH * square_px * 1.5))
    p = np.array([0.37, 0.21, ANGLE, ANGLE + np.pi / 2.0, BLUR, MEAN, CONTRAST, 0.0, 0.0])
    y, x = np.mgrid[-half : half + 1, -half : half + 1]
    used = within(x - p[0], y - p[1])
    slopes = []
    for k, step in enumerate(STEPS):
        ends = [corner(p + sign * step * np.eye(9)[k], half)[used] for sign in (1.0, -1.0)]
        slopes.append((ends[0] - ends[1]) / (2.0 * step))
    slopes = np.array(slopes)
    covariance = np.linalg.inv(slopes @ slopes.T) * (NOISE**2 + 1.0 / 12.0)
    return np.sqrt(np.trace(covariance[:2, :2]) / 2.0)


def measured(square_px):
    """RMS per axis, px, and in stated deviations."""
    image, truth = board(square_px)
    at, size = grid(INNER), image.shape[::-1]
    sense = np.where(at.sum(axis=1) % 2 == 0, -1.0, 1.0)
    errors, normalised = [], []
    for draw in range(DRAWS):
        rng = np.random.default_rng(draw)
        first = BoardMap.fit(at, truth + rng.uniform(-0.3, 0.3, truth.shape), size, np.ones(len(at)), hold=1.0)
        found = refine_corners(digitised(image, rng, NOISE), first, CornerSites(at, sense))
        assert found.consistent.all()
        errors.append(found.points_px - truth)
        whitener = np.linalg.cholesky(np.linalg.inv(found.covariance_px2)).transpose(0, 2, 1)
        normalised.append((whitener @ errors[-1][..., None])[..., 0])
    return (np.sqrt(np.mean(np.square(values))) for values in (errors, normalised))


@pytest.mark.slow  # pictures of 1400 px with 16 cells to a pixel
def test_corners_stand_near_the_bound_of_their_pixels():
    """Writes docs/evidence/corner-bound.md."""
    rows, ratios = [], []
    back = np.linalg.inv(lines(1.0))
    for square_px in SIDES:
        whole = bound(
            square_px,
            lambda x, y, s=square_px: np.all(np.abs(np.tensordot(back, np.stack((x, y)), 1)) < REACH * s, axis=0),
        )
        small = bound(square_px, lambda x, y: np.hypot(x, y) < WINDOW_PX)
        rms, normalised = measured(square_px)
        ratios.append(rms / whole)
        rows.append(f"| {square_px} | {whole:.5f} | {small:.5f} | {rms:.5f} | {rms / whole:.2f} | {normalised:.2f} |")
        print(rows[-1], flush=True)
    PLACE.write_text(page(rows))
    assert max(ratios) < MOST_RATIO


def page(rows):
    """The page of evidence."""
    return f"""# Corners over the bound of their pixels

Written by `python -m pytest -m slow tests/pipelines/detection/test_corner_bound.py` on
{datetime.date.today().isoformat()} with {versions()}.

A chessboard drawn by brute force, turned by 17 degrees, blur {BLUR} px, noise of {NOISE:g} grey levels and rounding;
white and black are {2 * CONTRAST:g} grey levels apart; {DRAWS} pictures of {INNER[0] * INNER[1]} corners. The bound is
that of Cramer and Rao for the corner's place, from derivatives of the drawing; the directions of both edges, the blur,
both grey levels and the slope of the light are unknown, too. Its pixels are those within {REACH} squares of the corner
along both axes, so that neighbours share hardly any. All are px per axis.

| square px | bound | bound of a window of {WINDOW_PX} px | found, RMS | over the bound | in stated deviations |
|---|---|---|---|---|---|
{chr(10).join(rows)}
"""

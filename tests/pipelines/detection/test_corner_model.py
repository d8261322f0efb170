"""The fit of a corner on pictures by brute force: where it is, and how well it says it knows."""

import numpy as np
import pytest

from pipelines.detection.corner_model import fit_corners
from pipelines.detection.corner_picture import BLUR, SHAPE, CornerTask
from pipelines.detection.corner_sites import REACH
from pipelines.detection.corners import SHARP_PX, STOP
from tests.supersampled import digitised, picture, side

HALF = 12  # of a tile, px
TILE = 2 * HALF + 1
COLUMNS = 10  # tiles in a row of a picture
SQUARE_PX = 20.0
WINDOW_PX = 10
STEPS = 40  # the detection takes up to 5, from its first map, and then 12: from near by
MEAN, CONTRAST = 110.0, 85.0  # of an ordinary picture, grey values


def degrees(first, between):
    return tuple(np.deg2rad((first, first + between)))


# Directions of the edges' normals; curvatures, 1/px; slope of the light, 1/px; blur, px.
SCENES = {
    "straight": {"angles": degrees(11, 90)},
    "along the pixels": {"angles": degrees(0, 90)},
    "30 degrees of skew": {"angles": degrees(11, 60)},
    "60 degrees of skew": {"angles": degrees(11, 30)},
    "60 degrees the other way": {"angles": degrees(11, 150)},
    "curved": {"angles": degrees(17, 80), "bends": (0.004, -0.003)},
    "curved more than any lens": {"angles": degrees(17, 80), "bends": (0.01, 0.01)},
    "sloped light": {"angles": degrees(17, 90), "light": (0.004, -0.006)},
    "sharp": {"angles": degrees(17, 90), "blur": 0.3},
    "sharp, along the pixels": {"angles": degrees(0, 90), "blur": 0.15},
    "sharp, 40 degrees of skew": {"angles": degrees(5, 50), "blur": 0.15},
    "sloped light, heavy blur": {"angles": degrees(17, 90), "light": (0.02, -0.03), "blur": 2.5},
    "heavy blur": {"angles": degrees(17, 90), "blur": 2.5},
    "everything": {"angles": degrees(23, 50), "bends": (0.003, 0.004), "light": (0.004, 0.003), "blur": 1.2},
}
IN_TIERS = [pytest.param(name, marks=pytest.mark.full) if "degrees" in name else name for name in SCENES]
# Rounded to 8 bits, nothing else: measured 0.0007 px RMS and 0.002 at worst. An edge along the pixels is rounded alike
# all along it; the fit knows a corner of heavy blur, or of skew, two to three times less well: measured 0.008 at worst.
CLEAN_PX = {
    "along the pixels": 0.008,
    "60 degrees of skew": 0.008,
    "60 degrees the other way": 0.01,
    "heavy blur": 0.008,
    "sloped light, heavy blur": 0.02,  # without the shift by sigma^2 g = 0.23 px, measured 0.24
}
ELSEWHERE_PX = 0.007  # with all at once measured 0.0045


def edge(x, y, corner, angle, bend):
    """The side of an edge through the corner: a line or a circle, by its distance."""
    u, v = x - corner[0], y - corner[1]
    if bend == 0.0:
        return side(np.cos(angle) * u + np.sin(angle) * v)
    radius = 1.0 / bend
    distance = np.hypot(u - radius * np.cos(angle), v - radius * np.sin(angle))
    return side(np.sign(radius) * (abs(radius) - distance))


def tile(corner, angles, bends=(0.0, 0.0), light=(0.0, 0.0), blur=0.7):
    """Grey values around a corner, given in px from the tile's middle."""

    def grey(x, y):
        x, y = x - HALF, y - HALF
        saddle = edge(x, y, corner, angles[0], bends[0]) * edge(x, y, corner, angles[1], bends[1])
        lit = 1.0 + light[0] * (x - corner[0]) + light[1] * (y - corner[1])
        return (MEAN + CONTRAST * saddle) * lit

    return picture(grey, TILE, TILE, blur)


def mosaic(scene, corners):
    """One picture of many corners."""
    tiles = [tile(corner, **scene) for corner in corners]
    return np.block([tiles[i : i + COLUMNS] for i in range(0, len(tiles), COLUMNS)])


def fitted(image, corners, scene, rng, start_px=0.3, **changed):
    """Errors (n, 2) px and what `fit_corners` gave, from starts up to `start_px` off along both axes."""
    n, angles = len(corners), scene["angles"]
    middles = HALF + TILE * np.array([[i % COLUMNS, i // COLUMNS] for i in range(n)], np.float64)
    shapes = np.full((n, SHAPE), np.nan)
    blur = np.hypot(scene.get("blur", 0.7), np.sqrt(1.0 / 12.0))
    shapes[:, :BLUR], shapes[:, BLUR], shapes[:, -2:] = (0.0, 0.0, *angles), max(blur, 0.4), 0.0
    lines = np.array([[-np.sin(a), np.cos(a)] for a in angles[::-1]])  # the squares' sides lie along the edges
    inverse = np.linalg.inv(SQUARE_PX * lines.T)
    given = {
        "starts": middles + corners + rng.uniform(-start_px, start_px, (n, 2)),
        "edges": np.tile([(0.5 * bend, 0.0, bend**3 / 8.0) for bend in scene.get("bends", (0.0, 0.0))], (n, 1, 1)),
        "sharp": np.full(n, blur < SHARP_PX),
        "bands": np.full(n, np.inf),
        "reaches": np.full((n, 2), REACH),
        "discs": np.empty((0, 2)),
        "disc_axes": np.eye(2),
        **changed,
    }
    task = CornerTask(
        shapes=shapes,
        clears=np.full(n, np.inf),
        inverses=np.tile(inverse, (n, 1, 1)),
        windows=np.full(n, WINDOW_PX),
        **given,
    )
    shapes, covariance, noise, converged = fit_corners(image, task, STEPS, STOP)
    return shapes[:, :2] - middles - corners, shapes, covariance * noise[:, None, None], noise, converged


def whitened(error, covariance):
    return (np.linalg.cholesky(np.linalg.inv(covariance)).transpose(0, 2, 1) @ error[..., None])[..., 0]


@pytest.mark.parametrize("name", IN_TIERS)
def test_a_corner_is_found_with_the_covariance_it_states(name):
    scene, rng = SCENES[name], np.random.default_rng(1)
    corners = rng.uniform(-0.5, 0.5, (20, 2))
    image = mosaic(scene, corners)
    error, shapes, _, _, converged = fitted(digitised(image, rng, 0.0), corners, scene, rng)
    assert np.all(converged)
    assert np.linalg.norm(error, axis=1).max() < CLEAN_PX.get(name, ELSEWHERE_PX)
    # The pixel's own area is a box of variance 1/12. Of a blur of 0.15 px along the pixels, one row of pixels tells.
    expected = np.sqrt(scene.get("blur", 0.7) ** 2 + 1.0 / 12.0)
    assert np.abs(shapes[:, BLUR] - expected).max() < (0.03 if name.startswith("sharp") else 0.03 * expected)

    # Noise of two grey values, rounded: 18 pictures of 20 corners, 720 numbers. Their standard deviation is good to
    # 1 / sqrt(1440) = 0.026: 0.1 is four of those. No mean may be beyond four of its own, 4 / sqrt(360) = 0.21.
    found = [fitted(digitised(image, rng, 2.0), corners, scene, rng) for _ in range(18)]
    normalised = np.concatenate([whitened(error, covariance) for error, _, covariance, _, _ in found])
    assert np.all(np.concatenate([converged for *_, converged in found]))
    # Variance 4 and a twelfth of rounding; 250 pixels tell it to a tenth, 360 corners their mean to a hundredth.
    assert 3.6 < np.mean([noise for _, _, _, noise, _ in found]) < 4.6
    assert 0.9 < normalised.std() < 1.1
    assert np.abs(normalised.mean(axis=0)).max() < 0.21


def test_curvature_that_is_not_given_pulls_the_corner():
    """Why the bends are given: a straight model errs by far more than the noise."""
    scene, rng = SCENES["curved more than any lens"], np.random.default_rng(2)
    corners = rng.uniform(-0.5, 0.5, (10, 2))
    image = digitised(mosaic(scene, corners), rng, 0.0)
    error, *_ = fitted(image, corners, scene, rng, edges=np.zeros((10, 2, 3)))
    # Over 8 px of edge a bend of 0.01 / px deviates by 0.3 px at the end and a third of that in the mean.
    assert np.linalg.norm(error, axis=1).min() > 0.03


def test_too_few_pixels_give_nan():
    """By a short reach, by the picture's border and by a disc over the corner."""
    scene, rng = SCENES["straight"], np.random.default_rng(3)
    corners = rng.uniform(-0.5, 0.5, (10, 2))
    image = digitised(mosaic(scene, corners), rng, 0.0)
    reaches = np.full((10, 2), REACH)
    reaches[0] = 0.05  # a pixel along both axes
    discs = np.array([[HALF + TILE * 1.0, HALF]])
    error, shapes, covariance, noise, converged = fitted(
        image, corners, scene, rng, reaches=reaches, discs=discs, disc_axes=np.eye(2) / 13.0
    )
    # Of a disc of 13 px around a window of 10 nothing is left; it does not touch the other tiles' windows.
    lost = np.array([True, True] + [False] * 8)
    np.testing.assert_array_equal(np.isnan(noise), lost)
    assert np.isnan(shapes[lost]).all()
    assert np.isnan(covariance[lost]).all()
    assert not np.any(converged[lost])
    assert np.all(converged[~lost])
    assert np.linalg.norm(error[~lost], axis=1).max() < ELSEWHERE_PX

    # The first row of corners lies ten pixels above this picture: of each window two or three pixels are left.
    cut = np.ascontiguousarray(image[HALF + 10 :])
    starts = np.array([[HALF + TILE * i, -10.0] for i in range(10)])
    _, shapes, covariance, noise, converged = fitted(cut, corners, scene, rng, starts=starts)
    assert all(np.isnan(value).all() for value in (shapes, covariance, noise))
    assert not np.any(converged)


def test_pixels_on_a_disc_take_no_part():
    """A dark disc beside the corner is left out: the others' pixels find the corner as before."""
    scene, rng = SCENES["straight"], np.random.default_rng(4)
    corners = rng.uniform(-0.5, 0.5, (10, 2))
    image = digitised(mosaic(scene, corners), rng, 0.0)
    centre = np.array([HALF + TILE * 3 + 5.0, HALF + 4.0])
    y, x = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
    image[np.hypot(x - centre[0], y - centre[1]) < 4.0] = 10
    with_disc, *_ = fitted(image, corners, scene, rng)
    without, _, covariance, noise, converged = fitted(
        image, corners, scene, rng, discs=centre[None], disc_axes=np.eye(2) / 4.0
    )
    assert np.linalg.norm(with_disc[3]) > 0.05
    assert np.all(converged)
    # Fewer pixels tell less: what one grey level of noise does to this corner is more than to the others.
    spread = np.trace(covariance, axis1=1, axis2=2) / noise
    assert spread[3] > 1.1 * spread[4]
    assert np.linalg.norm(without, axis=1).max() < ELSEWHERE_PX


def test_spoiled_pixels_of_both_kinds_side_by_side_are_left_out():
    """Two white ones and a black one upon the corner. A piece of a square that is dark for bright covers it."""
    scene, rng = SCENES["straight"], np.random.default_rng(5)
    corners = rng.uniform(-0.5, 0.5, (10, 2))
    image = digitised(mosaic(scene, corners), rng, 1.0)
    middle = HALF + TILE * 3
    image[HALF, middle], image[HALF + 1, middle - 1], image[HALF + 1, middle] = 255, 255, 0
    covered = image[HALF - 4 : HALF - 1, HALF + TILE * 6 - 4 : HALF + TILE * 6 - 1]
    covered[:] = 255 - covered
    error, _, covariance, noise, _ = fitted(image, corners, scene, rng)
    usual = np.median(noise)
    assert noise[3] < 2.0 * usual
    assert np.linalg.norm(whitened(error, covariance)[3]) < 4.0  # a normal pair is farther off once in 3000
    assert noise[6] > 5.0 * usual

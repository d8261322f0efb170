"""The raised circle on pictures by brute force: its projected centre is found, not the centroid of what is seen."""

import math

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipelines.detection import circle_light
from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.circle import find_circle
from pipelines.detection.circle_model import fit_disc
from pipelines.detection.consistency import Corners
from render.targets.chessboard import Chessboard
from tests.supersampled import digitised, picture

TARGET = Chessboard()  # all lengths below in its squares
AT, RADIUS, HEIGHT = np.array([-0.5, 0.5]), 0.3, 0.1
WIDTH, TALL = 640, 480
WHITE, BLACK, DISC = 200.0, 15.0, 10.0  # grey values
LAMP, LAMP_SIDE = np.array([-4.0, -9.0, 26.0]), 9.0  # place, in squares above the board
LAMPS = (LAMP, np.array([14.0, -12.0, 20.0]), np.array([-16.0, 6.0, 18.0]))  # of a room
AROUND = 0.3  # share of the surroundings in the light
CELLS = 6  # to a pixel: what a cell jumps over averages out along the rim, 0.002 px are left
BLUR = 0.7  # px, before the pixels' own area
PIXEL = math.sqrt(1.0 / 12.0)  # standard deviation of a pixel's own area
EDGE_BLUR = math.hypot(BLUR, PIXEL)

# Focal length, px; angles of rotation, degrees; place of the circle's foot in the camera's frame, squares. The disc's
# radius is 15 px in each; the centroid of its image lies 0.09, 0.28 and 0.75 px off its centre's. In the near view it
# hides all of its shadow but a sickle 2 px wide.
VIEWS = {
    "far": (1000.0, (20, 20, 20), (0.2, 0.1, 20.0)),
    "tilted": (420.0, (50, -15, 30), (-0.3, 0.2, 8.0)),
    "near": (150.0, (25, -20, 200), (1.0, 0.8, 3.2)),
}


def view(name):
    """R, t, f of a pinhole camera with its centre in the picture's, and the board's map from its exact corners."""
    f, angles, foot = VIEWS[name]
    R = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    t = np.array(foot) - R[:, :2] @ AT
    centre = np.array([(WIDTH - 1) / 2.0, (TALL - 1) / 2.0])
    return R, t, f, centre


def project(camera, at, height):
    """(n, 2) px of (n, 2) points above the board."""
    R, t, f, centre = camera
    points = np.column_stack((at, np.full(len(at), -height))) @ R.T + t
    return f * points[:, :2] / points[:, 2:] + centre


def meet(camera, x, y, height):
    """Where the pixels' rays meet a plane above the board."""
    R, t, f, centre = camera
    ray = np.stack(((x - centre[0]) / f, (y - centre[1]) / f, np.ones_like(x)), axis=-1) @ R
    origin = -R.T @ t
    reach = (-height - origin[2]) / ray[..., 2]
    return origin[0] + reach * ray[..., 0], origin[1] + reach * ray[..., 1]


def sky(distance):
    """Share of an even surrounding that a point at a distance from the disc's axis sees: rays counted one by one."""
    steps = (np.arange(120) + 0.5) / 60.0 - 1.0
    a, b = (side.ravel() for side in np.meshgrid(steps, steps))
    inside = a**2 + b**2 < 1.0  # even on this disc is weighted by the cosine on the hemisphere
    a, b = a[inside], b[inside]
    rise = HEIGHT / np.sqrt(1.0 - a**2 - b**2)
    hit = [np.mean((d + rise * a) ** 2 + (rise * b) ** 2 < RADIUS**2) for d in np.linspace(0.0, 2.0, 101)]
    return 1.0 - np.interp(distance, np.linspace(0.0, 2.0, 101), hit)


def lamp(x, y, lamp=LAMP):
    """Share of a square lamp that is not hidden: shadows of 9 x 9 points."""
    steps = ((np.arange(9) + 0.5) / 9.0 - 0.5) * LAMP_SIDE
    share = HEIGHT / lamp[2]  # of the way to the lamp, at which its ray crosses the disc's plane
    farthest = (RADIUS + share * (np.hypot(*(lamp[:2] - AT)) + LAMP_SIDE)) / (1.0 - share)  # that a shadow may lie
    near = np.hypot(x - AT[0], y - AT[1]) < farthest
    x, y = x[near], y[near]
    total, shares = np.zeros_like(x), np.ones(near.shape)
    for dx in steps:
        for dy in steps:
            u, v = x + share * (lamp[0] + dx - x), y + share * (lamp[1] + dy - y)
            total += (u - AT[0]) ** 2 + (v - AT[1]) ** 2 >= RADIUS**2
    shares[near] = total / 81.0
    return shares


def board_with(name, disc=DISC, moved=0.0, lamps=(LAMP,)):
    """(480, 640) grey values, and the camera; only the circle's surroundings are drawn.

    disc: its grey value, or None for no disc. moved: squares along x from where it belongs.
    """
    camera = view(name)
    reach = np.array([[i, j] for i in (-0.8, 0.0, 0.8) for j in (-0.8, 0.0, 0.8)]) + AT
    outline = project(camera, reach, 0.0)
    low = np.maximum(np.floor(outline.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(outline.max(axis=0)).astype(int), (WIDTH, TALL))

    def grey(x, y):
        x, y = x + low[0], y + low[1]
        u, v = meet(camera, x, y, 0.0)
        # The square before the first corner is black.
        black = (np.floor(u) + np.floor(v)) % 2 == 0
        outside = (u < -1.0) | (v < -1.0)
        value = np.where(black & ~outside, BLACK, WHITE) * (1.0 + 0.03 * (u - AT[0]) - 0.02 * (v - AT[1]))
        u = u - moved
        if disc is None:
            return value
        value *= AROUND * sky(np.hypot(u - AT[0], v - AT[1])) + (1.0 - AROUND) * np.mean(
            [lamp(u, v, one) for one in lamps], axis=0
        )
        p, q = meet(camera, x, y, HEIGHT)
        return np.where((p - moved - AT[0]) ** 2 + (q - AT[1]) ** 2 < RADIUS**2, disc, value)

    image = np.full((TALL, WIDTH), WHITE)
    image[low[1] : high[1], low[0] : high[0]] = picture(grey, *(high - low), BLUR, CELLS)
    return image, camera


def exact_corners(image, camera, blur_px=EDGE_BLUR):
    """The board's corners where they are, known to no error, and their map."""
    at, points = grid(TARGET.inner), project(camera, grid(TARGET.inner), 0.0)
    board = BoardMap.fit(at, points, image.shape[::-1], np.ones(len(at)))
    sure = np.zeros((len(at), 2, 2))
    return Corners(points, sure, np.ones(len(at), bool), blur_px, WHITE - BLACK, board)


def found_in(image, camera, blur_px=EDGE_BLUR):
    return find_circle(image, exact_corners(image, camera, blur_px), grid(TARGET.inner), TARGET)


@pytest.fixture(scope="module")
def drawn():
    return {name: board_with(name) for name in VIEWS}


def centroid(camera):
    """Of the disc's image."""
    steps = (np.arange(400) + 0.5) / 200.0 - 1.0
    a, b = (side.ravel() for side in np.meshgrid(steps, steps))
    inside = np.stack((a, b), axis=1)[a**2 + b**2 < 1.0] * RADIUS + AT
    x, y = project(camera, inside, HEIGHT).T
    R, t, _, _ = camera
    depth = (np.column_stack((inside, np.full(len(inside), -HEIGHT))) @ R.T + t)[:, 2]
    weight = depth**-3.0  # area of the image of an area on a plane
    return np.array([np.sum(x * weight), np.sum(y * weight)]) / np.sum(weight)


# Measured without noise: 0.005, 0.006 and 0.028 px, of which the cells of the picture make 0.002. Near by, the shadow
# hides under the disc, and its rim, that of a square lamp, is not quite what the model says.
EXACT_PX = {"far": 0.015, "tilted": 0.015, "near": 0.035}


@pytest.mark.parametrize("name", VIEWS)
def test_what_is_found_is_the_centre_not_the_centroid(drawn, name):
    image, camera = drawn[name]
    truth = project(camera, AT[None], HEIGHT)[0]
    assert np.linalg.norm(centroid(camera) - truth) > 0.08
    circle = found_in(digitised(image, np.random.default_rng(0), 0.0), camera)
    assert np.linalg.norm(circle.centre_px - truth) < EXACT_PX[name]


# Largest RMS of normalised errors. Near by, the shadow hides under the disc, and what the model of its rim is off
# weighs as much as the noise; what is stated allows for it, also where it does not move the circle. Measured 0.8 to
# 0.93 of 60 pictures, whose 120 numbers tell it to 0.065; the near view's 40 to 0.11.
HONEST = {"far": 1.0, "tilted": 1.1, "near": 1.15}
DRAWS = {"far": 60, "tilted": 60, "near": 20}  # near by, a fit takes ten times as long as far away


@pytest.mark.parametrize("name", ["far", *(pytest.param(name, marks=pytest.mark.full) for name in ("tilted", "near"))])
def test_noise_moves_it_as_far_as_it_states(drawn, name):
    image, camera = drawn[name]
    truth, rng, errors, normalised = project(camera, AT[None], HEIGHT)[0], np.random.default_rng(1), [], []
    for _ in range(DRAWS[name]):
        circle = found_in(digitised(image, rng, 2.0), camera)
        assert circle is not None
        errors.append(circle.centre_px - truth)
        normalised.append(np.linalg.cholesky(np.linalg.inv(circle.covariance_px2)).T @ errors[-1])
    # Measured 0.009, 0.009 and 0.024 px, of which near by 0.022 are the clean picture's.
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 0.03
    assert 0.5 < np.sqrt(np.mean(np.square(normalised))) < HONEST[name]


# Measured 1.72 and 1.06; 0.04 and 0.02 px off. Taken for one lamp, 4.1 and 6.3, and 0.16 px.
@pytest.mark.parametrize("name", ["far", pytest.param("tilted", marks=pytest.mark.full)])
def test_the_light_of_several_lamps_is_in_what_it_states(name):
    image, camera = board_with(name, lamps=LAMPS)
    truth, rng, normalised = project(camera, AT[None], HEIGHT)[0], np.random.default_rng(4), []
    for _ in range(5):
        circle = found_in(digitised(image, rng, 1.0), camera)
        normalised.append(np.linalg.cholesky(np.linalg.inv(circle.covariance_px2)).T @ (circle.centre_px - truth))
    assert np.sqrt(np.mean(np.square(normalised))) < 2.0


WRONG = {"absent": {"disc": None}, "aside": {"moved": 0.14}, "far aside": {"moved": 0.35}, "pale": {"disc": 160.0}}


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG)
def test_no_disc_where_the_board_puts_it_is_none(name, wrong):
    """Not there; so far aside that it is none of this board's; or too pale to be a circle of black."""
    image, camera = board_with(name, **wrong)
    assert found_in(digitised(image, np.random.default_rng(2), 1.0), camera) is None


def test_a_disc_that_reaches_out_of_the_picture_is_none(drawn):
    image, (R, t, f, centre) = drawn["far"]
    truth = project((R, t, f, centre), AT[None], HEIGHT)[0]
    left = int(truth[0]) - 8  # the disc's radius is 14 px
    cut = np.ascontiguousarray(image[:, left:])
    assert found_in(digitised(cut, np.random.default_rng(3), 0.0), (R, t, f, centre - [left, 0.0])) is None


def test_a_large_circle_is_read_in_a_bounded_number_of_pixels(drawn, monkeypatch):
    """An enlarged picture has the circle where the small one has it, and its fit has not 36 times as many pixels."""
    (image, (R, t, f, centre)), by, pixels = drawn["tilted"], 6, []

    def counted(patch, *rest):
        pixels.append(len(patch.grey))
        return fit_disc(patch, *rest)

    monkeypatch.setattr(circle_light, "fit_disc", counted)
    small = digitised(image, np.random.default_rng(0), 0.0)
    large = cv2.resize(small, None, fx=by, fy=by, interpolation=cv2.INTER_CUBIC)
    found = found_in(large, (R, t, by * f, (centre + 0.5) * by - 0.5), by * EDGE_BLUR).centre_px
    assert np.linalg.norm((found + 0.5) / by - 0.5 - found_in(small, (R, t, f, centre)).centre_px) < 0.05  # 0.031
    assert max(pixels) < 140**2  # a disc of 60 px radius and the blur around it; it is 210 px wide here


@pytest.mark.parametrize("seed", range(4))
def test_noise_in_few_pixels_is_not_taken_for_more_lamps(drawn, monkeypatch, seed):
    """Twenty-two more shadows make the residuals of 450 pixels a twentieth less by fitting their noise."""
    (image, (R, t, f, centre)), fits = drawn["far"], []

    def counted(patch, *rest):
        fits.append(len(patch.grey))
        return fit_disc(patch, *rest)

    monkeypatch.setattr(circle_light, "fit_disc", counted)
    small = digitised(
        cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.random.default_rng(seed), 2.0
    )
    assert found_in(small, (R, t, 0.5 * f, (centre + 0.5) * 0.5 - 0.5), math.hypot(0.5 * BLUR, PIXEL)) is not None
    assert len(fits) == 2  # where the board puts it, and looked for around
    assert max(fits) < 500

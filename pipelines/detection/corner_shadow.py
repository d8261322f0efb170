"""Least squares of corners that the edge of a shadow crosses: the picture of `shadow_picture` nearest to the pixels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection import corner_picture
from pipelines.detection.board_map import BoardMap
from pipelines.detection.corner_model import BLUR_LIMITS_PX, FURTHEST_STEP, LEAST_NOISE, CornerFits
from pipelines.detection.corner_picture import CONTRAST, MEAN, CornerTask
from pipelines.detection.corner_sites import CornerSites
from pipelines.detection.sampling import sample
from pipelines.detection.shadow_picture import BEND, BLUR, LEVELS, OFFSET, SHAPE, SOFT, TURN, Patch, bases

LEAST_PIXELS = 3 * (SHAPE + LEVELS)  # three for each number: fewer would follow anything
STEPS = 25  # with 15 two of 1080 corners under hard shadows were lost, with 25 none
MOST_TRIED = 6  # corners of a picture, for its time: such a fit takes ten times as long as a plain one
WHITEST, MOST_WHITE = 254.0, 0.02  # a window in whose pixels so large a share is clipped lies in glare, not in shadow
STEP_OF_SLOPES = np.array([1e-2, 1e-2, 2e-3, 2e-3, 1e-2, 1e-2, 2e-3, 1e-4, 1e-2])  # of a shape, for its slopes
MOST_STEP = np.array([*FURTHEST_STEP, 1.0, 0.2, 0.01, 1.0])  # of a shape in one iteration; the levels are linear
MOST_BEND = 0.02  # 1/px: a shadow's edge of a radius below 25 px is no single curve in a window
START_TURNS, START_PX = 16, 1.0  # directions and distances that are tried for a shadow's edge
START_SOFT = (0.3, 3.0)  # softness of its light that is tried, blurs
LEAST_IN_SHADOW = 0.04  # of the contrast in the light: what covers a board has none at all
ARM, ASIDE = 0.35, 0.2  # squares along and across the four edges of a corner, where black is told from white
LEAST_ARMS, LEAST_ARM = 3, 0.1  # with so much of the board's contrast: a shadow's edge may run along one of them
LEAST_SHADE = 0.2  # of the board's contrast, by which the shadow darkens white: less loses no corner
ARMS = np.array([[ARM, 0.0], [0.0, ARM], [-ARM, 0.0], [0.0, -ARM]])


class _State(NamedTuple):
    shape: Array  # (9,)
    levels: Array  # (8,) of the bases
    drawn: Array  # (8, n)
    residual: Array  # (n,)
    square: float  # sum of the residuals' squares


def looks_shadowed(image: NDArray[np.float32], board: BoardMap, sites: CornerSites, contrast: float) -> Mask:
    """(n,) whether there is black beside white on at least three of the four edges that meet in a corner, and white in
    the light and in the shade.

    Beneath what covers a corner there are no more than two. contrast: of the board, between white and black.
    """
    aside = ASIDE * (ARMS == 0.0)
    places = np.stack([sites.at[:, None] + ARMS + way * aside for way in (1.0, -1.0)])
    grey = sample(image, board(places.reshape(-1, 2))).reshape(2, len(sites.at), len(ARMS))
    rise = (grey[1] - grey[0]) * np.sign(ARMS.sum(axis=1)) * sites.sense[:, None]
    edges, white = np.sum(rise > LEAST_ARM * contrast, axis=1), grey.max(axis=0)
    return (edges >= LEAST_ARMS) & (np.ptp(white, axis=1) > LEAST_SHADE * contrast)


def fit_shadowed(image: NDArray[np.float32], task: CornerTask, stop: float) -> CornerFits:
    """Fit corners with the edge of a shadow near them, up to MOST_TRIED; what comes of it is as `fit_corners` gives it.

    Contrasts are those in the light. image: (height, width) light. stop: step, in standard deviations of what is
    fitted, at which it has converged.
    """
    count, tried = len(task.starts), 0
    fits = CornerFits(
        np.full((count, corner_picture.SHAPE), np.nan),
        np.full((count, 2, 2), np.nan),
        np.full(count, np.nan),
        np.zeros(count, bool),
    )
    for i in range(count):
        patch = _patch(image, task, i)
        if len(patch.grey) < LEAST_PIXELS or np.mean(patch.grey > WHITEST) > MOST_WHITE:
            continue
        tried += 1
        if tried > MOST_TRIED:
            break
        try:
            state = _nearest(patch, _start(patch, task.shapes[i]), stop)
            if state is not None and _is_shadow(state):
                _fill(fits, i, state, patch)
        except np.linalg.LinAlgError:  # pixels that do not tell the shape
            continue
        fits.shapes[i, :2] += task.starts[i]
    return fits


def _nearest(patch: Patch, start: Array, stop: float) -> _State | None:
    """What Levenberg and Marquardt come to; None where they do not converge."""
    state, damping = _drawn(start, patch), 1e-3
    jacobian = _jacobian(state, patch)
    for _ in range(STEPS):
        normal, right = jacobian @ jacobian.T, jacobian @ state.residual
        damped = normal + np.diag(damping * np.diag(normal) + 1e-9)
        step = np.linalg.solve(damped, right)
        is_last = step @ right <= stop**2 * state.square / _free(patch)
        new = _drawn(_moved(state.shape, step[:SHAPE]), patch)
        if new.square <= state.square:
            state, damping = new, 0.1 * damping
            jacobian = _jacobian(state, patch)
        else:
            damping *= 10.0
        if is_last:
            return state
    return None


def _fill(fits: CornerFits, i: int, state: _State, patch: Patch) -> None:
    """Row i of `fits`; its noise is weighed by what each pixel says of the position, as `fit_corners` does."""
    jacobian = _jacobian(state, patch)
    weight = np.sum(jacobian[:2] ** 2, axis=0)
    noise = float(weight @ state.residual**2 / (weight.sum() + 1e-300)) * len(patch.grey) / _free(patch)
    normal = jacobian @ jacobian.T
    fits.covariances[i] = np.linalg.inv(normal + np.diag(1e-12 * np.diag(normal)))[:2, :2]
    fits.noises[i], fits.converged[i] = max(noise, LEAST_NOISE), True
    fits.shapes[i, : BLUR + 1] = state.shape[: BLUR + 1]
    one, pattern, light, both = state.levels[:4]
    fits.shapes[i, MEAN], fits.shapes[i, CONTRAST] = one + max(light, 0.0), max(pattern, pattern + both, key=abs)


def _free(patch: Patch) -> int:
    """Degrees of freedom."""
    return len(patch.grey) - SHAPE - LEVELS


def _is_shadow(state: _State) -> bool:
    """Whether the darker side of the third edge shows the corner, too, with less contrast."""
    _, pattern, light, both = state.levels[:4]
    lit, shaded = (pattern + both, pattern) if light > 0.0 else (pattern, pattern + both)
    return bool(lit != 0.0 and LEAST_IN_SHADOW < shaded / lit < 1.0)


def _drawn(shape: Array, patch: Patch) -> _State:
    drawn = bases(shape, patch)
    levels = np.linalg.lstsq(drawn.T, patch.grey, rcond=1e-9)[0]
    residual = patch.grey - levels @ drawn
    return _State(shape, levels, drawn, residual, float(residual @ residual))


def _jacobian(state: _State, patch: Patch) -> Array:
    """(17, n) change of the model for a change of the shape and of the levels."""
    model = state.levels @ state.drawn
    rows = []
    for k, step in enumerate(STEP_OF_SLOPES):
        near = state.shape.copy()
        near[k] += step
        rows.append((state.levels @ bases(near, patch) - model) / step)
    return np.vstack((rows, state.drawn))


def _moved(shape: Array, step: Array) -> Array:
    """A shape after a step, within limits."""
    moved = shape + np.clip(step, -MOST_STEP, MOST_STEP)
    moved[BLUR] = np.clip(moved[BLUR], *BLUR_LIMITS_PX)
    moved[BEND] = np.clip(moved[BEND], -MOST_BEND, MOST_BEND)
    moved[SOFT] = abs(moved[SOFT])
    return moved


def _patch(image: NDArray[np.float32], task: CornerTask, i: int) -> Patch:
    """The pixels around corner i: up to the next edges, off the discs."""
    start, reach = task.starts[i], int(task.windows[i])
    left, top = np.floor(start + 0.5).astype(int)
    columns = np.arange(max(left - reach, 0), min(left + reach, image.shape[1] - 1) + 1)
    rows = np.arange(max(top - reach, 0), min(top + reach, image.shape[0] - 1) + 1)
    places = np.stack(np.meshgrid(columns - start[0], rows - start[1]), axis=-1)
    used = np.sum(places**2, axis=-1) <= reach**2
    used &= np.all(np.abs(places @ task.inverses[i].T) <= task.reaches[i], axis=-1)
    for centre in task.discs:
        used &= np.sum(((places + start - centre) @ task.disc_axes.T) ** 2, axis=-1) >= 1.0
    grey = image[np.ix_(rows, columns)][used].astype(np.float64)
    return Patch(columns - start[0], rows - start[1], used, task.edges[i], grey)


def _start(patch: Patch, shape: Array) -> Array:
    """(9,) with the third edge that explains the pixels best, of a corner that is where it is looked for."""
    start = np.zeros(SHAPE)
    reach = float(max(np.abs(patch.x).max(), np.abs(patch.y).max()))
    start[: BLUR + 1], start[OFFSET], start[SOFT] = shape[: BLUR + 1], 4.0 * reach, 1.0  # a third edge that is far off
    drawn, best = bases(start, patch), np.inf
    pattern, across, down = drawn[1], drawn[4], drawn[5]
    offsets, found = np.arange(-reach, reach + START_PX, START_PX), start.copy()
    for turn in np.arange(START_TURNS) * np.pi / START_TURNS:
        away = np.cos(turn) * across + np.sin(turn) * down - offsets[:, None]
        for soft in START_SOFT:
            light = 0.5 + 0.5 * np.tanh(0.8 * away / (start[BLUR] * np.hypot(1.0, soft)))  # nearly a blurred step
            squares = _squares_left(patch.grey, pattern, light)
            k = int(np.argmin(squares))
            if squares[k] < best:
                best = squares[k]
                found[OFFSET], found[TURN], found[SOFT] = offsets[k], turn, soft * start[BLUR]
    return found


def _squares_left(grey: Array, pattern: Array, light: Array) -> Array:
    """(k,) sums of squares that a print (n,) leaves of grey values (n,) under each of k lights (k, n)."""
    one = np.ones_like(light)
    every = np.stack((one, pattern * one, light, light * pattern), axis=1)
    normal, right = every @ every.transpose(0, 2, 1), every @ grey
    levels = np.linalg.solve(normal + 1e-6 * len(grey) * np.eye(4), right[..., None])[..., 0]
    return grey @ grey - np.sum(levels * right, axis=1)

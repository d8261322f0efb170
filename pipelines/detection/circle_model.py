"""Least squares of the raised circle: a dark disc over a board on which it casts its shade.

On a grid finer than the pixels, the picture is (k + h . x) D + (1 - D) (w + g . x - A b - L s - R (r - s)): the disc D
with grey k and a slope h, as stray light has, over white w with a slope g, of which the disc blocks a share b of the
surroundings' light, and the lamp's shadow s, a disc of the same size, displaced and with a soft rim. The rim's form is
that of the lamp: it is fitted between a bell's integral, s, and a straight ramp, r. All is moved along the streak of a
picture that moved, blurred by a gaussian and sampled at the pixels. k, w, g, h, A, L and R are linear and solved along;
disc and shadow are moved by Levenberg-Marquardt. Where there are several lamps or windows, further shadows stand for
the light from a dozen or two of directions, each with an L of its own.

Where the disc's rim lies in its own shade, no edge can be seen; the model knows that and takes the place from the rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from eposit.arrays import Array
from pipelines.detection.circle_numbers import (
    BLOCKED,
    DISC_GREY,
    DISC_SLOPE,
    FURTHER,
    LAMP,
    LINEAR,
    OBLONG,
    RIM,
    SHADOW,
    SHAPE,
    SIZE,
    SOFTNESS,
    WHITE_GREY,
    WHITE_SLOPE,
    DiscFit,
    Patch,
    Prior,
)
from pipelines.detection.circle_pixels import at_pixels
from pipelines.detection.circle_scatter import confirmed, scatter_of_sectors
from pipelines.detection.erf import GAUSS, decay, signed_share
from pipelines.detection.kernels import compiled

FURTHEST_STEP = np.array([0.15, 0.15, 0.02, 0.02, 0.02, 0.15, 0.15, 0.05])  # in one iteration
SOFTNESS_LIMITS = (0.01, 0.6)
BOX = math.sqrt(12.0)  # width of a box over its standard deviation, and of a ramp as wide as a bell's integral
# Of a motion between rows: px, of which resampling alone makes 0.13, and the fall of the squared residuals over the
# noise, which noise alone makes once in 20 000.
FIELDS_PX, FIELDS_GAIN = 0.3, 20.0
ROUNDING = 1.0 / 12.0  # variance of a grey value that was rounded: no picture is better known
STEPS = 60
PATIENCE = 10  # steps
START_NOISE = 4.0  # variance, grey values^2, before any is known
STOP = 0.5  # step, in standard deviations of what is fitted, at which a fit has converged; it is still made


@dataclass(frozen=True, slots=True)
class _Picture:
    """The model's picture at one shape: what is linear in it, and what moves."""

    opened: Array  # (h, w) share of a fine cell that the disc leaves open
    shade: Array  # (2, h, w) share of the lamp that is hidden, and how much more with a straight rim
    basis: Array  # (n, 9 + m) pixels for a change of the linear numbers
    rim: Array  # (5, h, w) change of `opened` with the disc's x, y, size and form
    edge: Array  # (2, 3, h, w) change of `shade` with its x, y and softness


class _LastStep(NamedTuple):
    """Of a fit that has converged."""

    step: Array  # (17 + m,)
    left: Array  # (n,) residuals behind it
    normal: Array  # (17 + m, 17 + m) of the normal equations, without the motion between rows
    aside: Array  # (17 + m, 17 + m) covariance that this motion adds, over the noise
    fields_px: Array  # (2,)


@compiled
def _open_share(v: Array, p: Array, per_px: Array, finer: int) -> tuple[Array, Array]:
    """Share of each fine cell that the disc leaves open, and its change with the disc's x, y, size and form (5, h, w).

    v: (2, h, w) places on its plane, radii from its centre.
    """
    _, height, width = v.shape
    out, slopes = np.empty((height, width)), np.empty((5, height, width))
    # Radii that a cell on the rim may lie from it: half a cell, at most as long as this, and a little for rounding.
    longest = math.sqrt(per_px[0, 0] ** 2 + per_px[0, 1] ** 2 + per_px[1, 0] ** 2 + per_px[1, 1] ** 2) / finer
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            u, w = v[0, i, j] - p[0], v[1, i, j] - p[1]
            a, b = u * (1.0 - p[3]) - w * p[4], w * (1.0 + p[3]) - u * p[4]
            radius = math.sqrt(a * a + b * b) + 1e-12
            if abs(radius - p[2]) > 0.51 * longest:
                out[i, j] = 0.0 if radius < p[2] else 1.0
                for k in range(5):
                    slopes[k, i, j] = 0.0
                continue
            across = (per_px[0, 0] * a + per_px[1, 0] * b) / radius
            down = (per_px[0, 1] * a + per_px[1, 1] * b) / radius
            per_radius = finer / math.sqrt(across * across + down * down)  # fine cells
            beyond = (radius - p[2]) * per_radius
            inside = -0.5 < beyond < 0.5
            out[i, j] = 0.5 + beyond if inside else 0.0 if beyond < 0.0 else 1.0
            slope = -per_radius if inside else 0.0
            slopes[0, i, j], slopes[1, i, j], slopes[2, i, j] = slope * a / radius, slope * b / radius, slope
            slopes[3, i, j], slopes[4, i, j] = slope * (a * u - b * w) / radius, slope * (a * w + b * u) / radius
    return out, slopes


@compiled
def _shadow(u: Array, p: Array) -> tuple[Array, Array]:
    """Share of the lamp that is hidden, by a rim that is a bell's integral, and how much more by a ramp (2, h, w).

    Second, their changes with the shadow's x, y and softness (2, 3, h, w). u: (2, h, w) places on the board, radii from
    the disc's foot.
    """
    _, height, width = u.shape
    out, slopes = np.empty((2, height, width)), np.empty((2, 3, height, width))
    for i in range(height):
        for j in range(width):
            a, b = u[0, i, j] - p[5], u[1, i, j] - p[6]
            radius = math.sqrt(a * a + b * b) + 1e-12
            beyond = (radius - 1.0) / p[7]
            bell, along = decay(0.5 * beyond * beyond), 0.5 - beyond / BOX
            out[0, i, j] = 0.5 - 0.5 * signed_share(beyond, bell)
            out[1, i, j] = (0.0 if along < 0.0 else 1.0 if along > 1.0 else along) - out[0, i, j]
            slope, ramp = 0.5 * GAUSS * bell / p[7], 1.0 / (BOX * p[7]) if 0.0 < along < 1.0 else 0.0
            for k in range(2):
                slopes[k, 0, i, j], slopes[k, 1, i, j] = slope * a / radius, slope * b / radius
                slopes[k, 2, i, j] = slope * beyond
                slope = ramp - slope
    return out, slopes


def fit_disc(patch: Patch, prior: Prior, steps: int = STEPS, hopeless: float = math.inf) -> DiscFit:
    """Fit one disc by Levenberg and Marquardt; the linear numbers are the best ones at each shape.

    hopeless: variance of the residuals, grey values^2, above which it is given up when it has had some steps.
    The loop is NumPy's, what takes time is compiled: a picture has one circle, and Numba needs seconds for a loop.
    """
    values, trial = np.zeros_like(prior.mean), np.zeros_like(prior.mean)
    trial[:SHAPE] = prior.start
    normal, right = np.eye(len(values)), np.zeros(len(values))
    jacobian, best = np.zeros((len(patch.grey), len(values))), np.zeros(len(patch.grey))
    cost, damping, noise = np.inf, 1e-3, START_NOISE
    for done in range(steps):
        if done == PATIENCE and best @ best > hopeless * len(best):
            break
        picture = _draw(patch, trial)
        weigh = noise / prior.spread**2
        trial[SHAPE:] = _best_levels(picture.basis, patch.grey, weigh[SHAPE:], prior.mean[SHAPE:])
        residual = patch.grey - picture.basis @ trial[SHAPE:]
        if residual @ residual + np.sum(weigh * (trial - prior.mean) ** 2) > cost:
            damping *= 10.0
        else:
            values, best, damping = trial.copy(), residual, max(0.1 * damping, 1e-9)
            jacobian = np.column_stack((_moves(patch, picture, values), picture.basis))
            noise = _noise(jacobian, residual)
            weigh = noise / prior.spread**2
            normal, right = jacobian.T @ jacobian, jacobian.T @ residual - weigh * (values - prior.mean)
            normal[np.diag_indices_from(normal)] += weigh + 1e-12 * normal.diagonal()
            cost = residual @ residual + np.sum(weigh * (values - prior.mean) ** 2)
        damped = normal.copy()
        damped[range(SHAPE), range(SHAPE)] *= 1.0 + damping
        step = np.linalg.solve(damped, right)
        if right @ step <= STOP * STOP * noise:
            return _finished(patch, prior, values, jacobian, best)
        trial = values.copy()
        trial[:SHAPE] += np.clip(step[:SHAPE], -FURTHEST_STEP, FURTHEST_STEP)
        trial[SHADOW] = np.clip(trial[SHADOW], -prior.furthest_shadow, prior.furthest_shadow)
        trial[SOFTNESS] = np.clip(trial[SOFTNESS], *SOFTNESS_LIMITS)
    covariance, left = np.linalg.inv(normal) * noise, float(best @ best / len(best))
    return DiscFit(values, covariance, False, left, 1.0, _with_size(covariance), 0.0, np.zeros(2))


def _finished(patch: Patch, prior: Prior, values: Array, jacobian: Array, best: Array) -> DiscFit:
    """A fit's last step, with a motion between even rows and odd ones taken out of it.

    values: (17 + m,) at which the fit has converged. jacobian, best: (n, 17 + m) change of the pixels and (n,)
    what is left of them there.
    """
    fields = _fields(patch, jacobian)
    first = _last_step(prior, values, jacobian, best, fields, _noise(jacobian, best))
    last = _last_step(prior, values, jacobian, best, fields, _noise(jacobian, first.left))
    noise = _noise(jacobian, last.left)
    fitted, weigh = values + last.step, noise / prior.spread**2
    inverse = np.linalg.inv(last.normal)
    factor = scatter_of_sectors(patch, jacobian, last.left, inverse, noise, prior.scatter)
    covariance, with_size = inverse * noise * factor + noise * last.aside, _with_size(inverse)
    pull = jacobian.T @ last.left - weigh * (fitted - prior.mean)
    oblong = _gain_of_form(last.normal, pull, weigh, fitted - prior.mean)
    oblong /= noise * confirmed(prior.scatter, factor)
    left = float(last.left @ last.left / len(best))
    return DiscFit(fitted, covariance, True, left, factor, with_size, oblong, last.fields_px)


def _last_step(prior: Prior, values: Array, jacobian: Array, best: Array, fields: Array, noise: float) -> _LastStep:
    """Least squares of all numbers and of a motion between rows, whose change of the pixels is `fields` (n, 2).

    A motion that noise or resampling may feign is left out: rows and columns are then alike.
    """
    weigh = noise / prior.spread**2
    normal, right = jacobian.T @ jacobian, jacobian.T @ best - weigh * (values - prior.mean)
    normal[np.diag_indices_from(normal)] += weigh + 1e-12 * normal.diagonal()
    step, moved = np.linalg.solve(normal, right), np.linalg.solve(normal, jacobian.T @ fields)
    beside, left = fields - jacobian @ moved, best - jacobian @ step
    spread = np.linalg.inv(fields.T @ beside + noise * np.eye(2))  # a motion of 1 px is usual where there is one
    share = spread @ (fields.T @ left)
    if share @ share < FIELDS_PX**2 or share @ (fields.T @ left) < FIELDS_GAIN * noise:
        return _LastStep(step, left, normal, np.zeros_like(normal), np.zeros(2))
    return _LastStep(step - moved @ share, left - beside @ share, normal, moved @ spread @ moved.T, share)


def _fields(patch: Patch, jacobian: Array) -> Array:
    """(n, 2) change of the pixels if between rows and those between them the picture moves by 1 px along x, and y."""
    moved = (jacobian[:, :2] + jacobian[:, SHADOW]) @ patch.per_px
    side = np.where(patch.rows % 2 == 0, 0.5, -0.5)
    return moved * (side - side.mean())[:, None]


def shadow_of(on_board: Array, place: tuple[float, float], softness: float) -> Array:
    """(h, w) share of a lamp that the disc hides at places (2, h, w), in radii from its foot."""
    shape = np.zeros(SHAPE)
    shape[SHADOW], shape[SOFTNESS] = place, softness
    return _shadow(on_board, shape)[0][0]


def cost_of(patch: Patch, prior: Prior, shape: Array) -> float:
    """Sum of squared residuals, grey values, of the picture of a shape (8,) with its best grey values."""
    picture, weigh = _draw(patch, shape), START_NOISE / prior.spread[SHAPE:] ** 2
    residual = patch.grey - picture.basis @ _best_levels(picture.basis, patch.grey, weigh, prior.mean[SHAPE:])
    return float(residual @ residual)


def _draw(patch: Patch, shape: Array) -> _Picture:
    """The picture at a shape, for each linear number alone."""
    opened, rim = _open_share(patch.on_disc, shape, patch.per_px, patch.finer)
    shade, edge = _shadow(patch.on_board, shape)
    white = at_pixels(patch, opened)
    under = (patch.slope_x, patch.slope_y, -patch.blocked, *-shade, *-patch.shadows)
    slopes, fields = under[:2], [opened * field for field in under]
    fields[2:2] = [(1.0 - opened) * slope for slope in slopes]
    basis = np.column_stack((1.0 - white, white, *(at_pixels(patch, field) for field in fields)))
    return _Picture(opened, shade, basis, rim, edge)


def _best_levels(basis: Array, grey: Array, weigh: Array, mean: Array) -> Array:
    """(8 + m,) linear numbers of least squares with what is known of them beforehand."""
    square, side = basis.T @ basis, basis.T @ grey
    square[np.diag_indices_from(square)] += weigh + 1e-9 * square.diagonal()
    return np.linalg.solve(square, side + weigh * mean)


def _moves(patch: Patch, picture: _Picture, values: Array) -> Array:
    """(n, 8) change of the pixels for a change of the shape."""
    gx, gy = values[WHITE_SLOPE] - values[DISC_SLOPE]
    under = values[WHITE_GREY] - values[DISC_GREY] + gx * patch.slope_x + gy * patch.slope_y
    under -= values[BLOCKED] * patch.blocked + values[LAMP] * picture.shade[0] + values[RIM] * picture.shade[1]
    under -= np.tensordot(values[FURTHER:], patch.shadows, 1)
    edges = (values[LAMP] * picture.edge[0] + values[RIM] * picture.edge[1]) * -picture.opened
    changes = (*(rim * under for rim in picture.rim), *edges)
    return np.column_stack([at_pixels(patch, change) for change in changes])


def _noise(jacobian: Array, residual: Array) -> float:
    """Variance of the residuals, each weighed by what its pixel says of the disc's place."""
    n, numbers = jacobian.shape
    weight = jacobian[:, 0] ** 2 + jacobian[:, 1] ** 2
    return max(np.sum(weight * residual**2) / max(np.sum(weight), 1e-300) * n / (n - numbers), ROUNDING)


def _with_size(covariance: Array) -> Array:
    """(2,) radii by which the place moves with the size, for a change of it by 1."""
    return covariance[:2, SIZE] / covariance[SIZE, SIZE]


def _gain_of_form(normal: Array, right: Array, weigh: Array, off: Array) -> float:
    """By how much the sum of squares would be less without what is known of the form, to first order.

    normal, right: normal equations. weigh: of what is known, in them. off: how far the numbers are from it.
    """
    free, pull = normal.copy(), right.copy()
    form = np.arange(len(right))[OBLONG]
    free[form, form] -= weigh[form]
    pull[form] += weigh[form] * off[form]
    return float(pull @ np.linalg.solve(free, pull))


def prepare() -> None:
    """Call each compiled function once."""
    places = np.ones((2, 1, 1))
    _open_share(places, np.ones(SHAPE + LINEAR), np.eye(2), 1)
    _shadow(places, np.ones(SHAPE + LINEAR))

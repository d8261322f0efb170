"""Sub-pixel corners: least squares of a blurred saddle, all corners at once.

Around a chessboard corner the image is two straight edges that cross, blurred by the point spread and the pixel:
grey = c + gx x + gy y + a erf(d1 / (sqrt 2 s)) erf(d2 / (sqrt 2 s)), with d1 and d2 the signed distances to the edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import erf

from eposit.arrays import Array

START_BLUR_PX = 0.8
BLUR_LIMITS_PX = (0.2, 6.0)
STEPS = 12
STEP_LIMIT = np.array([0.7, 0.7, 0.15, 0.15, 0.3])  # largest change in one step: px, px, rad, rad, px
STOP_PX = 1e-4
BLUR = 4  # place of the blur in a shape: u, v, two angles, blur


@dataclass(frozen=True, slots=True)
class Saddles:
    """Fitted corners."""

    points_px: Array  # (n, 2)
    blur_px: Array  # (n,) standard deviation of the blur
    moved_px: Array  # (n,) distance from the start


def fit_saddles(patches: Array, offsets: Array, weights: Array, angles: Array, starts: Array) -> Saddles:
    """Fit every patch.

    patches: (n, p) grey values. offsets: (n, p, 2) pixel positions, px. weights: (n, p), 0 where a pixel takes no part.
    angles: (n, 2) directions of the two edges' normals, rad. starts: (n, 2) px.
    """
    shape = np.column_stack((starts, angles, np.full(len(starts), START_BLUR_PX)))
    cost = _linear(patches, offsets, weights, shape)[1]
    damping = np.full(len(starts), 1e-3)
    for _ in range(STEPS):
        step = _step(patches, offsets, weights, shape, damping)
        trial = shape + np.clip(step, -STEP_LIMIT, STEP_LIMIT)
        trial[:, BLUR] = np.clip(trial[:, BLUR], *BLUR_LIMITS_PX)
        trial_cost = _linear(patches, offsets, weights, trial)[1]
        better = trial_cost <= cost
        shape[better], cost[better] = trial[better], trial_cost[better]
        damping = np.where(better, damping * 0.2, damping * 10.0)
        if np.all(np.abs(step[better, :2]) < STOP_PX) and np.all(better):
            break
    points = shape[:, :2]
    return Saddles(points, shape[:, BLUR], np.linalg.norm(points - starts, axis=1))


def _edges(offsets: Array, shape: Array) -> tuple[Array, Array]:
    """(2, n, p) signed distances to the edges over sqrt 2 s, and (n, p, 2) positions relative to the corner."""
    relative = offsets - shape[:, None, :2]
    normals = np.stack((np.cos(shape[:, 2:4]), np.sin(shape[:, 2:4])), axis=-1)  # (n, 2 edges, 2)
    distances = np.einsum("npk,nek->enp", relative, normals)
    return distances / (np.sqrt(2.0) * shape[:, BLUR, None]), relative


def _basis(offsets: Array, shape: Array) -> Array:
    """(n, p, 4) functions with linear coefficients: 1, x, y and the saddle."""
    scaled, relative = _edges(offsets, shape)
    saddle = erf(scaled[0]) * erf(scaled[1])
    return np.stack((np.ones_like(saddle), relative[..., 0], relative[..., 1], saddle), axis=-1)


def _linear(patches: Array, offsets: Array, weights: Array, shape: Array) -> tuple[Array, Array]:
    """(n, 4) best linear coefficients and the (n,) weighted sum of squared residuals."""
    basis = _basis(offsets, shape)
    coefficients = _solve(basis, weights, patches)
    residual = patches - np.einsum("npk,nk->np", basis, coefficients)
    return coefficients, np.sum(weights * residual**2, axis=1)


def _step(patches: Array, offsets: Array, weights: Array, shape: Array, damping: Array) -> Array:
    """(n, 5) Gauss-Newton step of the shape, with the linear coefficients solved along."""
    scaled, relative = _edges(offsets, shape)
    values, slopes = erf(scaled), 2.0 / np.sqrt(np.pi) * np.exp(-(scaled**2))
    basis = np.stack((np.ones_like(values[0]), relative[..., 0], relative[..., 1], values[0] * values[1]), axis=-1)
    coefficients = _solve(basis, weights, patches)
    residual = patches - np.einsum("npk,nk->np", basis, coefficients)
    bent = np.stack((slopes[0] * values[1], slopes[1] * values[0])) * coefficients[None, :, 3, None]
    blur = np.sqrt(2.0) * shape[:, BLUR, None]
    cosines, sines = np.cos(shape[:, 2:4]).T[..., None], np.sin(shape[:, 2:4]).T[..., None]
    along = relative[None, ..., 1] * cosines - relative[None, ..., 0] * sines  # d distance / d angle
    gradient_u, gradient_v = coefficients[:, 1, None], coefficients[:, 2, None]
    jacobian = np.concatenate(
        (
            np.stack(
                (
                    -np.sum(bent * cosines, axis=0) / blur - gradient_u,
                    -np.sum(bent * sines, axis=0) / blur - gradient_v,
                    bent[0] * along[0] / blur,
                    bent[1] * along[1] / blur,
                    -np.sum(bent * scaled, axis=0) / shape[:, BLUR, None],
                ),
                axis=-1,
            ),
            basis,
        ),
        axis=-1,
    )
    return _solve(jacobian, weights, residual, damping)[:, :5]


def _solve(basis: Array, weights: Array, values: Array, damping: Array | float = 1e-9) -> Array:
    """(n, k) weighted least squares by normal equations with a relative damping."""
    weighted = basis * weights[..., None]
    normal = np.einsum("npi,npj->nij", weighted, basis)
    diagonal = np.einsum("nii->ni", normal)
    normal = normal + np.eye(normal.shape[-1]) * (diagonal * np.reshape(damping, (-1, 1)) + 1e-9)[:, None, :]
    return np.linalg.solve(normal, np.einsum("npi,np->ni", weighted, values)[..., None])[..., 0]

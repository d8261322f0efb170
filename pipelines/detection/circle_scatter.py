"""How far the raised circle scatters beyond what independent noise does: filtered noise, what a model leaves out."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.detection.circle_numbers import Patch
from pipelines.detection.corner_scatter import PRIOR_FREEDOM

# Of the disc's surroundings, whose residuals are held against each other. Each is longer along the rim than filters,
# mosaics and blocks of compression reach, and across it a sector holds the whole edge: an edge that has another profile
# than the model pulls the rim in and out there, and moves nothing.
SECTORS = 12
TINY = 1e-100


def scatter_of_sectors(
    patch: Patch, jacobian: Array, residual: Array, inverse: Array, noise: float, usual: float
) -> float:
    """Factor of the covariance of a circle's place for residuals that neighbouring pixels share.

    Noise is independent from pixel to pixel. What a model leaves out goes on for many, and so does the noise of a
    picture that was filtered, resized or compressed: then the pixels of one sector around the disc together pull at its
    place by more than independent noise would. The fit has taken a part, often a half, of such pulls out of the
    residuals; how much is known for independent noise.

    Twelve sectors tell the factor to a third. So the expected one counts beside them, with as much freedom as the
    pixels' own noise has beside the scatter of corners: that of the board's corners, whose edges the same filters made,
    as far as the sectors show it, too; else 1.

    jacobian: (n, p) change of the pixels with the fit's numbers, of which the first two are the place. residual: (n,)
    at the numbers of the best fit. inverse: (p, p) covariance of these numbers for noise of unit variance. noise: its
    variance. usual: factor, 1 or more, by which the board's corners scatter.

    Source:
        White 1980, A heteroskedasticity-consistent covariance matrix estimator, with sectors in the place of pixels.
        Bell, McCaffrey 2002, Bias reduction in standard errors for linear regression with multi-stage samples:
        expectation under independent noise, and degrees of freedom by Satterthwaite.
    """
    along = np.arctan2(patch.rows - patch.rows.mean(), patch.columns - patch.columns.mean())
    sector = np.floor((along / np.pi + 1.0) * 0.5 * SECTORS).astype(np.intp) % SECTORS
    parts = [jacobian[sector == k] for k in range(SECTORS)]
    # In coordinates in which independent noise moves the place by one unit in every direction.
    variances, axes = np.linalg.eigh(inverse[:2, :2])
    moves = inverse[:, :2] @ axes / np.sqrt(np.maximum(variances, TINY))
    moved = np.concatenate([residual[sector == k] @ part @ moves for k, part in enumerate(parts)])
    told = np.vstack([(part.T @ (part @ moves)).T for part in parts])
    expected = -told @ inverse @ told.T
    for k in range(SECTORS):
        own = slice(2 * k, 2 * k + 2)
        expected[own, own] += told[own] @ moves
    total = max(float(np.trace(expected)), TINY)
    freedom = total**2 / max(float(np.sum(expected**2)), TINY)
    shown = float(moved @ moved) / (total * noise)
    return (freedom * shown + PRIOR_FREEDOM * confirmed(usual, shown)) / (freedom + PRIOR_FREEDOM)


def confirmed(usual: float, shown: float) -> float:
    """How much of the factor of the board's corners the circle shows, too; at least 1."""
    return min(usual, max(shown, 1.0))

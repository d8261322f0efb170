"""All corners of a board from one fit of a smooth map to them, with the covariance that they share.

Each corner's own pixels place it, with errors that are nearly independent of the others'. A smooth map from board to
picture has far fewer parameters than a board has coordinates, so the points of the map that fits all corners best have
smaller errors; but these errors are shared, and only their joint covariance says what the points tell together.

The map is that of `board_map`, a pose and a lens, and polynomials along the board for what it does not follow: a bent
sheet, a misprint that changes slowly, rows that are read one after another. How large they are is not known before,
and a test that leaves them out where they are not significant would hide errors as large as the noise. So their
coefficients are normal with a strength that the corners themselves tell: the result is the mean over strengths, each
weighted by the likelihood of the corners, and the scatter of these means is in the covariance. Where pose and lens
suffice, that is nearly their fit alone.

What changes from corner to corner, as print does that puts each of them a little elsewhere, is noise here: the points
are images of the board as designed, not as printed.

Source:
    Wahba 1983, Bayesian "confidence intervals" for the cross-validated smoothing spline: a posterior covariance of this
    kind covers on average over the places of one function.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legvander

from eposit.arrays import Array
from pipelines.detection.consistency import Corners
from pipelines.detection.corner_scatter import orthonormal
from pipelines.detection.print_scatter import with_print_scatter

MOST_DEGREE = 6  # of the polynomials
DECAYS = (0.2, 0.45, 1.0)  # of a polynomial's size from one degree to the next, over which is averaged
STRENGTHS = 2.0 ** np.arange(-5.0, 14.0)  # of the polynomials of degree 2, in deviations of a corner, likewise
LEAST_DEVIATION = 0.1  # of what a corner's own pixels state, in any direction: the lens of the map is no better
SAME = 1e-6  # relative size below which a polynomial is the same as others, or as a change of the map


class JointCorners(NamedTuple):
    """Points of one smooth map. The covariance of points i and j is factor[i] @ factor[j].T, px^2."""

    points_px: Array  # (n, 2)
    factor: Array  # (n, 2, k) px


class _Spectrum(NamedTuple):
    """What polynomials add to a map, along directions independent of each other and of the map's parameters."""

    directions: Array  # (m, r) orthonormal
    sizes: Array  # (r,) deviation along each for a strength of 1
    seen: Array  # (r,) what the corners show along each, in their deviations


def fit_board(corners: Corners, at: Array) -> JointCorners:
    """The consistent corners as points of the smooth map that fits them best. at: (n, 2) squares, of all corners."""
    good, board = corners.consistent, corners.board
    places, jacobian, slopes = at[good], board.jacobian(at[good]), board.slopes(at[good])
    missed = corners.points_px[good] - board(places)
    own = corners.covariance_px2[good] / max(corners.scatter, 1.0)
    lower = np.linalg.cholesky(with_print_scatter(places, missed, own, slopes, jacobian))
    fitted, factor = _smoothed(places, missed, lower, slopes)
    return JointCorners(board(places) + fitted, factor)


def _smoothed(at: Array, missed: Array, lower: Array, slopes: Array) -> tuple[Array, Array]:
    """The smooth part (n, 2) of (n, 2) distances from a map, px, and a factor (n, 2, k) of its covariance.

    lower: (n, 2, 2) Cholesky factors of the corners' covariances. slopes: (n, 2, p) of the map.
    """
    whitener, n = np.linalg.inv(lower), len(at)
    residuals = (whitener @ missed[..., None]).ravel()
    own = orthonormal((whitener @ slopes).reshape(2 * n, -1))
    deviation = np.sqrt(np.median(np.sum(lower**2, axis=(1, 2))) / 2.0)
    terms, degrees = _polynomials(at)
    both = deviation * (whitener[:, :, None, :] * terms[:, None, :, None])  # (n, 2, terms, 2)
    spectra = [
        _spectrum(own, (both * (decay ** (degrees - 2.0))[:, None]).reshape(2 * n, -1), residuals) for decay in DECAYS
    ]
    mean, spread = _averaged(spectra)
    fitted, factor = own @ (own.T @ residuals) + mean, np.hstack((own, spread))
    return (lower @ fitted.reshape(n, 2, 1))[..., 0], lower @ factor.reshape(n, 2, -1)


def _averaged(spectra: list[_Spectrum]) -> tuple[Array, Array]:
    """(m,) mean of the polynomials over strengths and decays, and (m, k) a factor of its covariance, both whitened."""
    likelihoods: list[Array] = []
    means: list[Array] = []
    variances: list[Array] = []
    for directions, sizes, seen in spectra:
        prior = (STRENGTHS[:, None] * sizes) ** 2
        share = prior / (1.0 + prior)  # of what is seen that belongs to the polynomials, and their variance after it
        likelihoods.append(-0.5 * np.sum(np.log1p(prior) + seen**2 / (1.0 + prior), axis=1))
        means.append((share * seen) @ directions.T)
        variances.append(share)
    weights = np.exp(np.stack(likelihoods) - np.max(likelihoods))
    weights /= weights.sum()
    mean = np.einsum("ds,dsm->m", weights, np.stack(means))
    parts = [(np.sqrt(weights)[..., None] * (np.stack(means) - mean)).reshape(-1, len(mean)).T]
    parts += [
        spectrum.directions * np.sqrt(weight @ share)
        for spectrum, weight, share in zip(spectra, weights, variances, strict=True)
    ]
    left, deviations, _ = np.linalg.svd(np.hstack(parts), full_matrices=False)
    rank = max(len(spectrum.sizes) for spectrum in spectra)
    return mean, left[:, :rank] * np.maximum(deviations[:rank], LEAST_DEVIATION)


def _spectrum(own: Array, polynomials: Array, residuals: Array) -> _Spectrum:
    """own: (m, p) orthonormal, of the map's parameters. polynomials: (m, k). residuals: (m,). All whitened."""
    beside = polynomials - own @ (own.T @ polynomials)
    left, sizes, _ = np.linalg.svd(beside, full_matrices=False)
    rank = int(np.sum(sizes > SAME * np.linalg.norm(polynomials, axis=0).max(initial=0.0)))
    rank = min(rank, beside.shape[0] - own.shape[1])
    return _Spectrum(left[:, :rank], sizes[:rank], left[:, :rank].T @ residuals)


def _polynomials(at: Array) -> tuple[Array, Array]:
    """(n, k) products of Legendre polynomials along the board, and (k,) their degrees."""
    low, high = at.min(axis=0), at.max(axis=0)
    along_x, along_y = (legvander(v, MOST_DEGREE) for v in (2.0 * (at - low) / np.maximum(high - low, 1e-9) - 1.0).T)
    i, j = np.mgrid[0 : MOST_DEGREE + 1, 0 : MOST_DEGREE + 1]
    rows, columns = (len(np.unique(values)) for values in at.T)
    used = (i + j <= MOST_DEGREE) & (i < rows) & (j < columns)
    return along_x[:, i[used]] * along_y[:, j[used]], (i + j)[used]

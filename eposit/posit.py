"""POSIT, EPOSIT and centred EPOSIT: linear starts that iterate on scaled orthography.

The three share one iteration and differ in how image points become pinhole-equivalent points (x, y at depth 1):
POSIT takes them from the bearing, EPOSIT from the paper's G(theta), centred EPOSIT from bearings turned so that
M0's ray is the axis. Arrays here have the problems last: images (2, n, b), poses R (3, 3, b) and t (3, b).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask, cross, pick

COMPRESS = 4  # finished problems leave the arrays when they are one in so many: leaving costs, and so does staying


@dataclass(frozen=True, slots=True)
class Start:
    """Poses from a start or a search; rows that failed may be NaN."""

    R: Array  # (3, 3, b)
    t: Array  # (3, b), unit of the object points
    iterations: NDArray[np.int64]  # (b,)
    converged: Mask  # (b,)

    def put(self, rows: NDArray[np.int64], other: Start) -> None:
        """Overwrite some rows with those of another result; iterations add up."""
        self.R[..., rows], self.t[:, rows], self.converged[rows] = other.R, other.t, other.converged
        self.iterations[rows] += other.iterations

    def take(self, rows: NDArray[np.int64]) -> Start:
        """Some of the rows."""
        return Start(pick(self.R, rows), pick(self.t, rows), self.iterations[rows], self.converged[rows])


@dataclass(slots=True)
class _Work:
    """The problems still iterated on."""

    rows: NDArray[np.int64]  # (a,) their numbers
    image: Array  # (2, n - 1, a) points but M0
    base: Array  # (2, n - 1, a) the same minus M0
    epsilon: Array  # (n - 1, a) relative depths
    previous: Array  # (2, 3, a) I and J of the last iteration

    def keep(self, kept: NDArray[np.int64]) -> None:
        """Drop the others."""
        self.rows = self.rows[kept]
        self.image, self.base, self.epsilon, self.previous = (
            pick(values, kept) for values in (self.image, self.base, self.epsilon, self.previous)
        )


def posit(
    points_in_obj: Array,
    image: Array,
    tol: float,
    max_iterations: int,
    epsilon: Array | None = None,
    step: float = 1.0,
) -> Start:
    """The POSIT iteration on pinhole points.

    points_in_obj: (n, 3), not coplanar. image: (2, n, b), x and y at depth 1.
    tol: stop when I and J change by less than this, relative to their length.
    epsilon: (n - 1, b) first guess of the relative depths, zero if None. step: fraction of each update that is taken.
    Source:
        Paper, equations 21 to 25; DeMenthon and Davis 1995.
    """
    with np.errstate(all="ignore"):
        vectors, iterations, converged = _iterate(points_in_obj, image, tol, max_iterations, epsilon, step)
        R = nearest_frame(vectors)
        depth = 2.0 / np.add.reduce(lengths(vectors), axis=0)
        t = -np.einsum("ijb,j->ib", R, points_in_obj[0])
        t += depth
        t[:2] += (image[:, 0] - 1.0) * depth
    return Start(R, t, iterations, converged)


def _iterate(
    points_in_obj: Array, image: Array, tol: float, max_iterations: int, epsilon: Array | None, step: float
) -> tuple[Array, NDArray[np.int64], Mask]:
    """I and J, (2, 3, b), NaN where they do not converge, the number of iterations, and where they converge."""
    offsets = points_in_obj[1:] - points_in_obj[0]
    solver: Array = np.linalg.pinv(offsets)
    b = image.shape[-1]
    result = np.full((2, 3, b), np.nan)
    iterations, converged = np.zeros(b, np.int64), np.zeros(b, bool)
    depths = np.zeros((len(offsets), b)) if epsilon is None else epsilon
    others = image[:, 1:]
    work = _Work(np.arange(b), others, others - image[:, :1], depths, np.full((2, 3, b), np.inf))
    active = np.isfinite(np.sum(image, axis=(0, 1)))
    for count in range(1, max_iterations + 1):
        if not np.all(active) and COMPRESS * np.count_nonzero(active) <= (COMPRESS - 1) * len(active):
            kept = np.flatnonzero(active)
            work.keep(kept)
            active = np.ones(len(kept), bool)
        if not len(active):
            break
        right = work.epsilon * work.image
        right += work.base
        vectors = np.einsum("ij,ajb->aib", solver, right)
        scale, k = _scale_and_axis(vectors)
        depths = np.einsum("ni,ib->nb", offsets, k)
        work.epsilon = depths if step == 1.0 else work.epsilon + step * (depths - work.epsilon)
        work.previous -= vectors
        change = np.einsum("aib,aib->b", work.previous, work.previous)
        work.previous = vectors
        small = change <= (tol * scale) ** 2
        gone = active & (small | ~np.isfinite(scale))
        if np.any(gone) or count == max_iterations:
            gone = active if count == max_iterations else gone
            good = np.flatnonzero(gone & small)
            result[..., work.rows[good]], converged[work.rows[good]] = pick(vectors, good), True
            iterations[work.rows[gone]] = count
            active = active & ~gone
    return result, iterations, converged


def _scale_and_axis(vectors: Array) -> tuple[Array, Array]:
    """Scale 1 / Z0, the mean length of I and J, (2, 3, b), and the third axis k of this length, (3, b)."""
    size = lengths(vectors)
    scale = 0.5 * (size[0] + size[1])
    k = cross(vectors[0], vectors[1])
    k *= scale / np.sqrt(np.einsum("ib,ib->b", k, k))
    return scale, k


def lengths(vectors: Array) -> Array:
    """(2, b) lengths of I and J, (2, 3, b)."""
    return np.sqrt(np.einsum("aib,aib->ab", vectors, vectors))


def nearest_frame(vectors: Array) -> Array:
    """(3, 3, b) rotations with rows i, j, k from I and J, (2, 3, b), the defect shared between i and j."""
    i, j = vectors / lengths(vectors)[:, None]
    both = np.stack((i + j, i - j))
    both *= np.sqrt(0.5) / lengths(both)[:, None]
    rotation = np.empty((3, 3, vectors.shape[-1]))
    np.add(both[0], both[1], out=rotation[0])
    np.subtract(both[0], both[1], out=rotation[1])
    rotation[2] = cross(rotation[0], rotation[1])
    return rotation

"""Scaled orthography: the equations whose fixed point POSIT looks for, as a function of three unknowns.

The unknown is k, the third axis of the camera in the object's frame over the depth of the object's first point. Arrays
have the problems last: images (2, n, b), k (3, b), and I and J, the first two axes over the depth, (2, 3, b).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import DTypeLike, NDArray

from eposit.arrays import Array, cross, take_last


@dataclass(frozen=True, slots=True)
class Orthography:
    """I and J of b problems, `rest + pull k` for any number of points. Lengths are over the object's reach."""

    reach: float  # largest distance from the first point, unit of the object points
    first_in_obj: Array  # (3,) the first point, unit of the object points
    first_seen: Array  # (2, b) its image
    rest: Array  # (2, 3, b) I and J of an object without depth
    pull: Array  # (2, 3, 3, b) what k adds to them
    contraction: Array  # (b,) k -> F(k) shortens distances to so much or less; below 1 it has one fixed point

    @staticmethod
    def of(points_in_obj: Array, image: Array) -> Orthography:
        """From (n, 3) points that are not coplanar and (2, n, b) pinhole points, x and y at depth 1.

        The contraction is the Frobenius norm of `pull`. With i, j, u of unit length along I, J, k and M the pull of
        each, the slope of F is u (i M_x + j M_y) / 2 - i (u M_x) - j (u M_y) for I and J of equal length at right
        angles. Its terms have ranges at right angles, and each takes rows of M that no other takes: its norm is below
        that of M.
        Source:
            Paper, equations 23 to 25: A I = (1 + A k) x - x_0, so that the unknowns are in k alone.
        """
        offsets = points_in_obj[1:] - points_in_obj[0]
        reach = float(np.sqrt(np.max(np.sum(offsets**2, axis=1))))
        offsets = offsets / reach
        solver: Array = np.linalg.pinv(offsets)
        rest = np.einsum("ij,ajb->aib", solver, image[:, 1:] - image[:, :1])
        pull = np.einsum("ikj,ajb->aikb", solver[:, None] * offsets.T, image[:, 1:])
        contraction = np.sqrt(np.einsum("aikb,aikb->b", pull, pull))
        return Orthography(reach, points_in_obj[0], image[:, 0], rest, pull, contraction)

    @staticmethod
    def side_by_side(systems: Sequence[Orthography]) -> Orthography:
        """Systems of several objects of the same reach and first point as one."""
        names = ("first_seen", "rest", "pull", "contraction")
        together = (np.concatenate([getattr(system, name) for system in systems], axis=-1) for name in names)
        return Orthography(systems[0].reach, systems[0].first_in_obj, *together)

    def take(self, rows: NDArray[np.int64]) -> Orthography:
        """Some of the problems."""
        parts = (take_last(values, rows) for values in (self.first_seen, self.rest, self.pull, self.contraction))
        return Orthography(self.reach, self.first_in_obj, *parts)

    def astype(self, dtype: DTypeLike) -> Orthography:
        """With I and J in another precision."""
        return replace(self, rest=self.rest.astype(dtype), pull=self.pull.astype(dtype))

    def axes(self, k: Array | None) -> Array:
        """I and J at k; at zero if None."""
        if k is None:
            return self.rest
        found = np.einsum("aikb,kb->aib", self.pull, k)
        found += self.rest
        return found

    def pose(self, axes: Array) -> tuple[Array, Array]:
        """R (3, 3, b) and t (3, b) of I and J."""
        size = lengths(axes)
        R = nearest_frame(axes, size)
        depth = 2.0 * self.reach / (size[0] + size[1])
        t = -np.einsum("ijb,j->ib", R, self.first_in_obj)
        t += depth
        t[:2] += (self.first_seen - 1.0) * depth
        return R, t


def third_axis(axes: Array) -> tuple[Array, Array]:
    """The mean length of I and J, (b,), and k = F of it: at right angles to both and of this length, (3, b)."""
    size = lengths(axes)
    scale = size[0] + size[1]
    scale *= 0.5
    k = cross(axes[0], axes[1])
    k *= scale / np.sqrt(np.einsum("ib,ib->b", k, k))
    return scale, k


def lengths(axes: Array) -> Array:
    """(2, b) lengths of I and J."""
    return np.sqrt(np.einsum("aib,aib->ab", axes, axes))


def nearest_frame(axes: Array, size: Array) -> Array:
    """(3, 3, b) rotations with rows i, j, k from I and J and their lengths, the defect shared between i and j."""
    i, j = axes / size[:, None]
    both = np.empty_like(axes)
    np.add(i, j, out=both[0])
    np.subtract(i, j, out=both[1])
    both *= (np.sqrt(0.5) / lengths(both))[:, None]
    rotation = np.empty((3, 3, axes.shape[-1]))
    np.add(both[0], both[1], out=rotation[0])
    np.subtract(both[0], both[1], out=rotation[1])
    rotation[2] = cross(rotation[0], rotation[1])
    return rotation

"""The shape of an object's points: flat, long or narrow, and which methods that allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eposit.arrays import Array

COPLANAR_CONDITION = 1e4  # cond(A) from which the points count as coplanar: there double precision leaves 12 digits


@dataclass(frozen=True, slots=True)
class Shape:
    """What an object's points allow."""

    solid: bool  # whether the linear methods have equations for it

    @staticmethod
    def of(points_in_obj: Array) -> Shape:
        """The shape of (n, 3) points."""
        values = np.linalg.svd(points_in_obj[1:] - points_in_obj[0], compute_uv=False)
        return Shape(bool(values[0] <= COPLANAR_CONDITION * values[-1] and values[-1] > 0.0))


def plane_axes(points_in_obj: Array) -> tuple[Array, Array, Array]:
    """Centroid (3,), axes (3, 3) as rows, that of least spread last, and spreads (3,) of (n, 3) points."""
    centroid = points_in_obj.mean(axis=0)
    _, spreads, axes = np.linalg.svd(points_in_obj - centroid, full_matrices=True)
    return centroid, axes, np.pad(spreads, (0, 3 - len(spreads)))

"""A smooth map from board to image, fitted to the corners. It needs no camera: any lens is smooth across a board."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eposit.arrays import Array, Mask

DEGREE = 5  # leaves 0.02 px on a fish-eye board 500 px wide, and 0.4 px where it fills the picture


@dataclass(frozen=True, slots=True)
class BoardMap:
    """Polynomial map from board coordinates (squares, first inner corner at the origin) to px."""

    coefficients: Array  # (terms, 2)
    inner: tuple[int, int]  # inner corners along x and y

    @staticmethod
    def fit(corners_px: Array, inner: tuple[int, int], use: Mask | None = None) -> BoardMap:
        """Least squares over (n, 2) corners, or over those in the (n,) mask."""
        use = np.ones(len(corners_px), bool) if use is None else use
        basis = _basis(inner, grid(inner))
        return BoardMap(np.linalg.lstsq(basis[use], corners_px[use], rcond=None)[0], inner)

    def __call__(self, at: Array) -> Array:
        """(m, 2) or (2,) board coordinates to (m, 2) px."""
        return _basis(self.inner, np.atleast_2d(at)) @ self.coefficients

    def jacobian(self, at: Array, step: float = 1e-3) -> Array:
        """(m, 2, 2) px per square at (m, 2) board coordinates; (2, 2) at one. Columns are along x and along y."""
        points = np.atleast_2d(at)
        columns = [(self(points + d) - self(points - d)) / (2.0 * step) for d in np.eye(2) * step]
        slopes = np.stack(columns, axis=-1)
        return slopes[0] if np.ndim(at) == 1 else slopes

    def invert(self, point_px: Array, start: Array) -> Array:
        """(2,) board coordinates whose image is (2,) px, by Newton's method from `start`."""
        at = np.array(start, dtype=np.float64)
        for _ in range(4):
            at = at + np.linalg.solve(self.jacobian(at), point_px - self(at)[0])
        return at

    def parallax(self, at: Array, height: float) -> Array:
        """(2,) px that a point `height` squares above the board is displaced by, up to its sign.

        Under a local scaled orthography the map's singular values are s and s cos(tilt); the normal is displaced by
        s sin(tilt) along the direction that is foreshortened.
        """
        left, singular, _ = np.linalg.svd(self.jacobian(at))
        return left[:, 1] * height * np.sqrt(max(singular[0] ** 2 - singular[1] ** 2, 0.0))


def grid(inner: tuple[int, int]) -> Array:
    """(n, 2) column and row of the inner corners, in squares."""
    y, x = np.mgrid[0 : inner[1], 0 : inner[0]]
    return np.stack((x.ravel(), y.ravel()), axis=1).astype(np.float64)


def leave_one_out(corners_px: Array, inner: tuple[int, int], use: Mask) -> Array:
    """(n,) distance of each corner from the map fitted to the others in the (n,) mask, px."""
    basis = _basis(inner, grid(inner))
    coefficients = np.linalg.pinv(basis[use])
    leverage = np.zeros(len(basis))
    leverage[use] = np.einsum("ij,ji->i", basis[use], coefficients)
    misses = corners_px - basis @ (coefficients @ corners_px[use])
    return np.linalg.norm(misses, axis=1) / np.maximum(1.0 - leverage, 1e-6)


def _basis(inner: tuple[int, int], at: Array) -> Array:
    """(m, terms) monomials at board coordinates scaled to [-1, 1]."""
    x, y = (at / np.array([inner[0] - 1, inner[1] - 1]) * 2.0 - 1.0).T
    most_x, most_y = min(DEGREE, inner[0] - 2), min(DEGREE, inner[1] - 2)
    powers = [(i, j) for i in range(most_x + 1) for j in range(most_y + 1) if i + j <= DEGREE]
    return np.stack([x**i * y**j for i, j in powers], axis=1)

"""Perspective from three points on bearings: every pose of a triangle, so that no basin is missed.

Source:
    Grunert 1841 in the form of Haralick et al. 1994 (law of cosines, one quartic); the elimination is worked out here.
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array


def p3p_starts(points_in_obj: Array, bearings: Array, keep: int) -> list[tuple[Array, Array]]:
    """The `keep` poses of the widest triangle that fit all points best, best first; NaN where there are fewer.

    points_in_obj: (n, 3). bearings: (b, n, 3) unit vectors, any direction. Each pose is (b, 3, 3) with (b, 3).
    """
    triangle = _widest_triangle(points_in_obj)
    depths = _depths(points_in_obj[triangle], bearings[:, triangle])  # (b, 4, 3)
    corners = depths[..., None] * bearings[:, None, triangle, :]  # (b, 4, 3 points, 3)
    R = _frame(corners) @ np.swapaxes(_frame(points_in_obj[triangle]), -1, -2)
    t = corners.mean(axis=2) - R @ points_in_obj[triangle].mean(axis=0)
    seen = points_in_obj @ np.swapaxes(R, -1, -2) + t[..., None, :]
    with np.errstate(invalid="ignore", divide="ignore"):
        seen = seen / np.linalg.norm(seen, axis=-1, keepdims=True)
    misfit = np.sum((seen - bearings[:, None]) ** 2, axis=(2, 3))
    order = np.argsort(np.where(np.isfinite(misfit), misfit, np.inf), axis=1)[:, :keep]
    rows = np.arange(len(bearings))
    return [(R[rows, column], t[rows, column]) for column in order.T]


def _widest_triangle(points_in_obj: Array) -> list[int]:
    """Three points of large area: the two farthest apart, then the one farthest from their line."""
    gaps = np.linalg.norm(points_in_obj[:, None] - points_in_obj[None], axis=-1)
    first, second = np.unravel_index(np.argmax(gaps), gaps.shape)
    areas = np.linalg.norm(
        np.cross(points_in_obj - points_in_obj[first], points_in_obj[second] - points_in_obj[first]), axis=1
    )
    return [int(first), int(second), int(np.argmax(areas))]


def _depths(triangle: Array, bearings: Array) -> Array:
    """(b, 4, 3) distances of the corners along their rays; NaN for roots without a pose.

    With u = s2 / s1 and v = s3 / s1 the laws of cosines give u as a rational function of v and a quartic in v.
    """
    a2, b2, c2 = (np.sum((triangle[i] - triangle[j]) ** 2) for i, j in ((1, 2), (0, 2), (0, 1)))
    cos_a, cos_b, cos_c = (np.sum(bearings[:, i] * bearings[:, j], axis=1) for i, j in ((1, 2), (0, 2), (0, 1)))
    one, zero = np.ones_like(cos_a), np.zeros_like(cos_a)
    q = (one, -2.0 * cos_b, one)  # (s1^2 + s3^2 - 2 s1 s3 cos_b) / s1^2, coefficients by rising power of v
    ratio = (a2 - c2) / b2
    numerator = (-1.0 - ratio * q[0], -ratio * q[1], 1.0 - ratio * q[2])
    denominator = (-2.0 * cos_c, 2.0 * cos_a)
    rest = tuple(base - c2 / b2 * part for base, part in zip((one, zero, zero), q, strict=True))
    terms = (
        _multiply(_multiply(denominator, denominator), rest),
        _multiply(numerator, numerator),
        tuple(-2.0 * cos_c * value for value in _multiply(numerator, denominator)),
    )
    quartic = [sum((term[power] for term in terms if power < len(term)), start=zero) for power in range(5)]
    v = _quartic_roots(quartic)
    with np.errstate(all="ignore"):
        u = _evaluate(numerator, v) / _evaluate(denominator, v)
        s1 = np.sqrt(b2 / _evaluate(q, v))
        depths = np.stack((s1, u * s1, v * s1), axis=-1)
        return np.where(np.all(depths > 0.0, axis=-1, keepdims=True), depths, np.nan)


def _quartic_roots(rising: list[Array]) -> Array:
    """(b, 4) real parts of the roots: noise turns a double root into a complex pair; its real part is a good start."""
    lead = np.where(np.abs(rising[4]) > 1e-14 * np.max(np.abs(rising), axis=0), rising[4], np.nan)
    companion = np.zeros((len(lead), 4, 4))
    companion[:, [1, 2, 3], [0, 1, 2]] = 1.0
    companion[:, :, 3] = -np.stack(rising[:4], axis=1) / lead[:, None]
    usable = np.all(np.isfinite(companion), axis=(1, 2))
    roots = np.full((len(lead), 4), np.nan)
    roots[usable] = np.linalg.eigvals(companion[usable]).real
    return roots


def _multiply(left: tuple[Array, ...], right: tuple[Array, ...]) -> tuple[Array, ...]:
    """Product of two polynomials given by coefficients of rising power."""
    product = [np.zeros_like(left[0]) for _ in range(len(left) + len(right) - 1)]
    for i, p in enumerate(left):
        for j, r in enumerate(right):
            product[i + j] = product[i + j] + p * r
    return tuple(product)


def _evaluate(rising: tuple[Array, ...], v: Array) -> Array:
    total = np.zeros_like(v)
    for coefficient in reversed(rising):
        total = total * v + coefficient[:, None]
    return total


def _frame(corners: Array) -> Array:
    """(..., 3, 3) orthonormal columns spanned by a triangle's (..., 3 points, 3) edges."""
    with np.errstate(invalid="ignore", divide="ignore"):
        along = corners[..., 1, :] - corners[..., 0, :]
        along = along / np.linalg.norm(along, axis=-1, keepdims=True)
        normal: Array = np.cross(along, corners[..., 2, :] - corners[..., 0, :])
        normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    across: Array = np.cross(normal, along)
    return np.stack((along, across, normal), axis=-1)

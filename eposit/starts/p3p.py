"""Perspective from three points on bearings: every pose of a triangle, so that no basin is missed.

Arrays have the problems last: rays (n, 3, b), poses R (3, 3, b) and t (3, b).

Source:
    Grunert 1841 in the form of Haralick et al. 1994 (law of cosines, one quartic); the elimination is worked out here.
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array, cross
from eposit.starts.quartic_roots import quartic_roots


def p3p_poses(points_in_obj: Array, rays: Array, keep: int) -> list[tuple[Array, Array]]:
    """The `keep` poses of the widest triangle that fit all points best, best first; NaN where there are fewer.

    points_in_obj: (n, 3). rays: (n, 3, b) unit vectors, any direction.
    """
    triangle, b = _widest_triangle(points_in_obj), rays.shape[-1]
    with np.errstate(all="ignore"):
        depths = _depths(points_in_obj[triangle], rays[triangle])  # (3, 4, b)
        corners = (depths[:, None] * rays[triangle][:, :, None]).reshape(3, 3, 4 * b)
        frame = _frame(points_in_obj[triangle][..., None])[..., 0]
        R = np.einsum("ikb,jk->ijb", _frame(corners), frame)
        t = np.add.reduce(corners, axis=0) / 3.0 - np.einsum("ijb,j->ib", R, points_in_obj[triangle].mean(axis=0))
        misfit = ray_misfit(points_in_obj, np.tile(rays, 4), R, t).reshape(4, b)
    order = np.argsort(np.where(np.isfinite(misfit), misfit, np.inf), axis=0)[:keep]
    turns, places = R.reshape(3, 3, 4, b), t.reshape(3, 4, b)
    return [
        (
            np.take_along_axis(turns, row[None, None, None], 2)[:, :, 0],
            np.take_along_axis(places, row[None, None], 1)[:, 0],
        )
        for row in order
    ]


def ray_misfit(points_in_obj: Array, rays: Array, R: Array, t: Array) -> Array:
    """(b,) sums over the points of the squared distance between (n, 3, b) unit rays and the poses' rays."""
    point = np.einsum("nj,ijb->nib", points_in_obj, R)
    point += t
    point /= np.sqrt(np.einsum("nib,nib->nb", point, point))[:, None]
    point -= rays
    return np.einsum("nib,nib->b", point, point)


def _widest_triangle(points_in_obj: Array) -> list[int]:
    """Three points of large area: the two farthest apart, then the one farthest from their line."""
    gaps = np.linalg.norm(points_in_obj[:, None] - points_in_obj[None], axis=-1)
    first, second = np.unravel_index(np.argmax(gaps), gaps.shape)
    areas = np.linalg.norm(
        np.cross(points_in_obj - points_in_obj[first], points_in_obj[second] - points_in_obj[first]), axis=1
    )
    return [int(first), int(second), int(np.argmax(areas))]


def _depths(triangle: Array, rays: Array) -> Array:
    """(3, 4, b) distances of the corners along their (3, 3, b) rays; NaN for roots without a pose.

    With u = s2 / s1 and v = s3 / s1 the laws of cosines give u as a rational function of v and a quartic in v.
    """
    a2, b2, c2 = (np.sum((triangle[i] - triangle[j]) ** 2) for i, j in ((1, 2), (0, 2), (0, 1)))
    cos_a, cos_b, cos_c = (np.einsum("ib,ib->b", rays[i], rays[j]) for i, j in ((1, 2), (0, 2), (0, 1)))
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
    v = quartic_roots(quartic)
    u = (numerator[0] + v * (numerator[1] + v * numerator[2])) / (denominator[0] + v * denominator[1])
    s1 = np.sqrt(b2 / (1.0 + v * (q[1] + v)))
    depths = np.stack((s1, u * s1, v * s1))
    return np.where(np.all(depths > 0.0, axis=0), depths, np.nan)


def _multiply(left: tuple[Array, ...], right: tuple[Array, ...]) -> tuple[Array, ...]:
    """Product of two polynomials given by coefficients of rising power."""
    product = [np.zeros_like(left[0]) for _ in range(len(left) + len(right) - 1)]
    for i, p in enumerate(left):
        for j, r in enumerate(right):
            product[i + j] = product[i + j] + p * r
    return tuple(product)


def _frame(corners: Array) -> Array:
    """(3, 3, b) rotations whose columns are spanned by the edges of (3 points, 3, b) triangles."""
    along = corners[1] - corners[0]
    along = along / np.sqrt(np.einsum("ib,ib->b", along, along))
    normal = cross(along, corners[2] - corners[0])
    normal = normal / np.sqrt(np.einsum("ib,ib->b", normal, normal))
    return np.stack((along, cross(normal, along), normal), axis=1)

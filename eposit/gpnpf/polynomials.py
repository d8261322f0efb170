"""The polynomial system of GPnPf in the depth ratio s and the squared focal length F, and its ten solutions.

Points 0 and 1 lie at depths 1 - s and 1 + s along the rays w = (x, y, f), so E = P1 - P0 = e + 2 s (0, 0, f) with
e = (w1 - w0) + s (w1 + w0) in the image, and |E|^2 = |e|^2 + 4 s^2 F. A further point i is lambda_i w_i with

    (P_i - P0) . E = along |E|^2          along = (X_i - X0) . (X1 - X0) / |X1 - X0|^2
    |P_i - P0|^2   = reach |E|^2          reach = |X_i - X0|^2 / |X1 - X0|^2

The first gives lambda_i = 1 - s + M / c, with c = w_i . E and M = along |E|^2 - (1 - s) (w_i - w0) . e; the second is

    M^2 F + |M w_i + (1 - s) c (w_i - w0)|^2 - reach c^2 |E|^2 = 0,

of degree 3 in F and 4 in s. It is linear in F at s = 0, and with H = s^2 F its coefficients lose that degeneracy. Two
such polynomials have a resultant in s of degree 18 = 10 + 8: the factors s^2, (1 - s^2)^2 and |e|^2 are solutions with
a vanishing ray or edge, and are divided out.

Source:
    Zheng, Sugimoto, Sato, Okutomi 2014, "A general and simple method for camera pose and focal length determination",
    for the unknowns; the elimination is worked out here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array

SOLUTIONS = 10
ANGLES = np.pi * (np.arange(8) + 0.5) / 8.0  # upper half of 16 nodes on a circle; conjugates give the other half
RADII = (0.9, 0.25, 0.07)  # circles of s: a far object has s of the order of its size over its distance
Numbers = NDArray[Any]  # real or complex, results as arguments: Any, as a type of either is accepted by neither's users


@dataclass(frozen=True, slots=True)
class System:
    """n - 2 polynomials for each of b images; the edge is points 0 and 1."""

    w: Array  # (2, n, b) image points about the principal point, in any unit
    along: Array  # (n - 2,)
    reach: Array  # (n - 2,)

    def take(self, rows: NDArray[np.int64]) -> System:
        """The same polynomials for some images."""
        return replace(self, w=self.w[:, :, rows])

    def edge(self, s: Numbers) -> tuple[Numbers, Numbers]:
        """e, the edge in the image, for s (..., b)."""
        w0, w1 = self.w[:, 0], self.w[:, 1]
        return (w1[0] - w0[0]) + s * (w1[0] + w0[0]), (w1[1] - w0[1]) + s * (w1[1] + w0[1])

    def coefficients(self, s: Numbers) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """q0, q1, q2, q3, each (..., n - 2, b): polynomials q0 + F (q1 + q2 H + q3 H^2), H = s^2 F; s is (..., b)."""
        points, gaps = self.w[:, 2:], self.w[:, 2:] - self.w[:, :1]
        along, reach = self.along[:, None], self.reach[:, None]
        s, (ex, ey) = s[..., None, :], (part[..., None, :] for part in self.edge(s))
        e2, c = ex * ex + ey * ey, points[0] * ex + points[1] * ey  # c + 2 s F is the whole w_i . E
        m = along * e2 - (1.0 - s) * (gaps[0] * ex + gaps[1] * ey)  # m + 4 along H is the whole M
        ux, uy = (m * points[axis] + (1.0 - s) * c * gaps[axis] for axis in (0, 1))
        vx, vy = (4.0 * along * s * points[axis] + 2.0 * (1.0 - s) * gaps[axis] for axis in (0, 1))
        q0 = ux * ux + uy * uy - reach * c * c * e2
        q1 = m * m + 2.0 * s * (ux * vx + uy * vy) - 4.0 * reach * s * c * (e2 + s * c)
        q2 = 8.0 * along * m + vx * vx + vy * vy - 4.0 * reach * (e2 + 4.0 * s * c)
        return q0, q1, q2, 16.0 * (along * along - reach) + 0.0 * c

    def values(self, s: Numbers, F: Array) -> Numbers:
        """(..., n - 2, b) values of the polynomials."""
        q0, q1, q2, q3 = self.coefficients(s)
        H = (s * s * F)[..., None, :]
        return q0 + F[..., None, :] * (q1 + H * (q2 + H * q3))

    def slope_in_focal2(self, s: Array, F: Array) -> Array:
        """(..., n - 2, b) derivatives by F."""
        _, q1, q2, q3 = self.coefficients(s)
        H = (s * s * F)[..., None, :]
        return q1 + H * (2.0 * q2 + 3.0 * H * q3)


def minors(cubics: tuple[Numbers, ...]) -> dict[tuple[int, int], Numbers]:
    """a_i b_j - a_j b_i of the first two cubics' coefficients, each (..., n - 2, b)."""
    a, b = ([q[..., which, :] for q in cubics] for which in (0, 1))
    return {(i, j): a[i] * b[j] - a[j] * b[i] for i in range(4) for j in range(i)}


def depth_ratios(system: System) -> NDArray[np.complex128]:
    """(10, b) complex roots s of the first two polynomials' resultant.

    Each coefficient is read off the circle on which it is largest against rounding.
    """
    j = np.arange(SOLUTIONS + 1)
    read, error = _coefficients(system, j)
    rising = np.take_along_axis(read, np.argmin(error, axis=0)[None], axis=0)[0]  # (11, b)
    with np.errstate(all="ignore"):
        size = np.abs(rising[0] / rising[-1]) ** (1.0 / SOLUTIONS)  # geometric mean of the roots
        monic = -(rising[:-1] / rising[-1]) * size ** (j[:-1, None] - SOLUTIONS)
    usable = np.all(np.isfinite(monic), axis=0) & (size > 0.0)
    companion = np.zeros((monic.shape[1], SOLUTIONS, SOLUTIONS))
    companion[:, j[1:-1], j[:-2]] = 1.0
    companion[:, :, -1] = np.where(usable, monic, 0.0).T
    roots = np.linalg.eigvals(companion).T * np.where(usable, size, np.nan)
    return roots.astype(np.complex128)


def _coefficients(system: System, j: NDArray[np.int64]) -> tuple[Array, Array]:
    """(3, 11, b) coefficients of the resultant from its values on each circle, and their error, up to a factor."""
    s = np.multiply.outer(RADII, np.exp(1j * ANGLES))[..., None]  # (3, 8, 1)
    q0, q1, q2, q3 = system.coefficients(s)
    m = minors((q0 * s[..., None, :] ** 2, q1, q2, q3))  # in H, after multiplication by s^2
    middle = m[3, 0] + m[2, 1]  # the Bezout matrix of the cubics in H
    resultant = (
        m[1, 0] * (middle * m[3, 2] - m[3, 1] ** 2)
        - m[2, 0] * (m[2, 0] * m[3, 2] - m[3, 1] * m[3, 0])
        + m[3, 0] * (m[2, 0] * m[3, 1] - middle * m[3, 0])
    )
    ex, ey = system.edge(s)
    known = s * s * (1.0 - s * s) ** 2 * (ex * ex + ey * ey)
    with np.errstate(all="ignore"):
        quotient = resultant / known
        total = np.zeros((len(RADII), len(j), quotient.shape[-1]))
        for node, angle in enumerate(ANGLES):  # in a fixed order: a batch gives the bits of single calls
            value = quotient[:, node, None]
            total += np.cos(j * angle)[:, None] * value.real + np.sin(j * angle)[:, None] * value.imag
        scale = np.array(RADII)[:, None, None] ** -j.astype(np.float64)[:, None]
        error = scale * (np.max(np.abs(resultant), axis=1) / np.min(np.abs(known), axis=1))[:, None]
    return total * scale / len(ANGLES), np.where(np.isfinite(error), error, np.inf)


def squared_focal(system: System, s: Array) -> Array:
    """(m,) the common root F of the first two polynomials at their real s (m,).

    A quadratic that both cubics imply, a3 b - b3 a, has it as one of its roots; the better one of the two is taken.
    """
    m = minors(system.coefficients(s))
    with np.errstate(all="ignore"):
        root = np.sqrt(np.maximum(m[3, 1] ** 2 - 4.0 * m[3, 2] * s * s * m[3, 0], 0.0))
        both = np.stack((-2.0 * m[3, 0] / (m[3, 1] + root), -2.0 * m[3, 0] / (m[3, 1] - root)))
        miss = np.sum(system.values(np.stack((s, s)), both)[:, :2] ** 2, axis=1)
    miss = np.where(np.isfinite(miss), miss, np.inf)
    return np.where(miss[0] <= miss[1], both[0], both[1])

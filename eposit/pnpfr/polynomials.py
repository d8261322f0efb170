"""The polynomial system of PnPfr: sixteen roots in the direction of the optical axis, twelve of which are cameras.

With w = x + i y in the image and depths lambda, the rows of the camera P = diag(f, f, 1) [R | t] obey
lambda_i w_i = (P1 + i P2) X_i and lambda_i (1 + k r_i^2) = P3 X_i. Let X_0 be the origin and y_i the dual basis of the
others (sum of y_i = 0), so that z = p1 + i p2 = sum lambda_i w_i y_i and p3 = sum lambda_i (1 + k r_i^2) y_i.

z is isotropic, z . z = 0, because p1 and p2 are orthogonal and equally long: z = (1 - t^2, i (1 + t^2), 2 t) up to a
factor, where t is the optical axis in stereographic projection. With b = lambda_0 w_0 the depths follow,
lambda_i = (b + X_i . z) / w_i, and the rest of the camera with them. What remains are z' . z' = 0 for
z' = p1 - i p2 = sum lambda_i conj(w_i) y_i, quadratic in b, and, k eliminated from z . p3 = 0 and z' . p3 = 0,
(z . p3a) (z' . p3b) = (z' . p3a) (z . p3b), cubic in b, where p3 = p3a + k p3b. Their resultant in t has degree 16: the
twelve solutions, and four at which z' is parallel to z, which is no camera.

Source:
    Larsson, Kukelova, Zheng 2017, "Making minimal solvers for absolute pose estimation compact and robust", for the
    equations; the elimination is worked out here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array

ROOTS, SOLUTIONS = 16, 12
PARALLEL = 1e-5  # sine of the angle between z and z' below which a root is none of the twelve
NODES = np.exp(2j * np.pi * (np.arange(20) + 0.25) / 20)  # on the unit circle; 17 would determine the resultant
Complex = NDArray[np.complexfloating]


@dataclass(frozen=True, slots=True)
class Roots:
    """The sixteen roots of b images; arrays (16, b)."""

    axis: Complex  # t
    depths: Complex  # (4, 16, b), up to a common factor
    k: Complex  # for w in its unit
    spurious: NDArray[np.bool_]  # z' parallel to z


def dual_basis(points: Array) -> Array:
    """(4, 3) vectors y_i with sum of y_i = 0 and y_i . (X_j - X_0) = delta_ij, of (4, 3) points that span space."""
    inverse = np.linalg.inv(points[1:] - points[0]).T
    return np.concatenate((-np.sum(inverse, axis=0, keepdims=True), inverse))


def solve_roots(points: Array, w: Complex) -> Roots:
    """points: (4, 3) in a frame in which no axis is special, the first at the origin. w: (4, b), none zero."""
    sampled = _Forms.at(NODES[:, None], points, w[:, None]).eliminate()[2]  # (20, b)
    j = np.arange(ROOTS + 1)
    rising = np.zeros((ROOTS + 1, w.shape[1]), np.complex128)
    for node, value in zip(NODES, sampled, strict=True):  # in a fixed order: a batch gives the bits of single calls
        rising += node ** -j[:, None] * value
    with np.errstate(all="ignore"):
        monic = -rising[:-1] / rising[-1]
    usable = np.all(np.isfinite(monic), axis=0)
    companion = np.zeros((w.shape[1], ROOTS, ROOTS), np.complex128)
    companion[:, j[1:-1], j[:-2]] = 1.0
    companion[:, :, -1] = np.where(usable, monic, 0.0).T
    t = np.where(usable, np.linalg.eigvals(companion).T, np.nan)
    return _cameras(t, points, w[:, None])


def _cameras(t: Complex, points: Array, w: Complex) -> Roots:
    forms = _Forms.at(t, points, w)
    with np.errstate(all="ignore"):
        slope, constant, _ = forms.eliminate()
        b = -constant / slope
        (a1, a0), (d1, d0) = forms.za, forms.zd
        k = -(b * a1 + a0) / (b * d1 + d0)
        other = [b * g + h for g, h in zip(forms.g, forms.h, strict=True)]
        across = np.abs(np.cross(forms.z, other, axis=0)) ** 2
        lengths = np.sum(np.abs(forms.z) ** 2, axis=0) * np.sum(np.abs(other) ** 2, axis=0)
        spurious = np.sum(across, axis=0) <= PARALLEL**2 * lengths
        return Roots(t, (b + forms.reach) / w, k, spurious)


@dataclass(frozen=True, slots=True)
class _Forms:
    """The forms in b at given t: constant and linear parts; a belongs to p3a, d to p3b, g and h to z' = b g + h."""

    z: Complex  # (3, ...)
    reach: Complex  # (4, ...) X_i . z
    g: list[Complex]
    h: list[Complex]
    za: tuple[Complex, Complex]  # z . p3a = b za[0] + za[1]
    zd: tuple[Complex, Complex]
    oa: tuple[Complex, Complex, Complex]  # z' . p3a = b^2 oa[0] + b oa[1] + oa[2]
    od: tuple[Complex, Complex, Complex]

    @staticmethod
    def at(t: Complex, points: Array, w: Complex) -> _Forms:
        """t: (m, b) or (m, 1). w: (4, 1, b)."""
        z = np.stack((1.0 - t * t, 1j * (1.0 + t * t), 2.0 * t))
        reach = np.stack([x * z[0] + y * z[1] + v * z[2] for x, y, v in points])
        dual = dual_basis(points)
        (g, h), (ga, ha), (gd, hd) = (_combine(dual, m, reach) for m in (w.conj() / w, 1.0 / w, w.conj()))
        oa = _dot(g, ga), _dot(g, ha) + _dot(h, ga), _dot(h, ha)
        od = _dot(g, gd), _dot(g, hd) + _dot(h, gd), _dot(h, hd)
        return _Forms(z, reach, g, h, (_dot(z, ga), _dot(z, ha)), (_dot(z, gd), _dot(z, hd)), oa, od)

    def eliminate(self) -> tuple[Complex, Complex, Complex]:
        """The cubic modulo the quadratic, slope b + constant, and the resultant of the two."""
        A, B, C = _dot(self.g, self.g), 2.0 * _dot(self.g, self.h), _dot(self.h, self.h)
        (a1, a0), (d1, d0) = self.za, self.zd
        q3 = a1 * self.od[0] - d1 * self.oa[0]
        q2 = a1 * self.od[1] + a0 * self.od[0] - d1 * self.oa[1] - d0 * self.oa[0]
        q1 = a1 * self.od[2] + a0 * self.od[1] - d1 * self.oa[2] - d0 * self.oa[1]
        q0 = a0 * self.od[2] - d0 * self.oa[2]
        slope = q3 * (B * B - A * C) - A * (q2 * B - A * q1)
        constant = q3 * B * C - A * (q2 * C - A * q0)
        return slope, constant, A * constant**2 - B * slope * constant + C * slope**2


def _combine(dual: Array, factors: Complex, reach: Complex) -> tuple[list[Complex], list[Complex]]:
    """The three coordinates of sum m_i y_i and of sum m_i (X_i . z) y_i."""
    return [_four(column, factors) for column in dual.T], [_four(column, factors * reach) for column in dual.T]


def _four(column: Array, values: Complex) -> Complex:
    return column[0] * values[0] + column[1] * values[1] + column[2] * values[2] + column[3] * values[3]


def _dot(a: Sequence[Complex] | Complex, b: Sequence[Complex] | Complex) -> Complex:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

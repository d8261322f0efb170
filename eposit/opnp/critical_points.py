"""Critical points of f(y) = |A v(y) + d|^2, where v holds the ten products y_i y_j of four unknowns.

Half the gradient is C(y) + L y with four cubic forms C and a (4, 4) matrix L. y and -y are critical together, so with
y = 0 set aside Bezout's 3^4 = 81 points are 40 pairs. The direction of a pair makes C(y) parallel to L y: the six
2 x 2 minors of [C, L y], forms of degree 4, vanish on 40 points of projective space and nowhere else. Their multiples
of degree 8 span 125 of the 165 monomials (Hilbert function of the Eagon-Northcott complex: 40 from degree 7 on), which
leaves 40 dimensions, and multiplication by a linear form there is a 40 x 40 matrix whose eigenvectors give the roots.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, solve_or_nan

PAIRS = 40
RANK = 125  # of the multiples of the minors in degree 8
DISTINCT = 1e-12  # squared sine between the directions of two roots below which they are one
JITTER = 1e-6  # relative change of A in the second search, before polishing: symmetric problems have curves of roots
POLISH_STEPS = 3  # complex Newton steps in the first search, whose roots are good to 1e-4 or better
MORE_STEPS = 8  # in the second
ROOT_TOL = 1e-6  # relative size of the last of them above which a root is lost
ZERO = 1e-6  # length, of about 1 otherwise, below which a root has run into y = 0
FIRST, SECOND = np.triu_indices(4)  # v_k = y[FIRST[k]] * y[SECOND[k]]


@dataclass(frozen=True, slots=True)
class Tables:
    """What does not depend on data: where each coefficient goes."""

    symmetric: NDArray[np.int64]  # (4, 4) k of v_k = y_i y_j
    slopes: Array  # (10, 4, 4): dv_k/dy = slopes[k] @ y
    cubic: Array  # (100, 80): A^T A to coefficients of C
    linear: Array  # (10, 16): A^T d to L
    product: Array  # (80, 35): coefficients of a cubic times a linear form to those of degree 4
    rows: NDArray[np.int64]  # (210, 35) columns, degree 8, of the multiples of the minors
    minor: NDArray[np.int64]  # (210,) the minor of each row
    chosen: NDArray[np.int64]  # (125,) rows that are independent
    by_first: Array  # (120, 165): the monomials of degree 7, times a linear form
    by_second: Array  # (120, 165): times another linear form
    mix: Array  # (40, 120): forty forms of degree 7
    powers: NDArray[np.int64]  # (4, 4) columns of y_i^7 y_j


def monomials(degree: int) -> list[tuple[int, ...]]:
    """Exponents of the monomials of four unknowns, in a fixed order."""
    chosen = combinations_with_replacement(range(4), degree)
    return [tuple(indices.count(i) for i in range(4)) for indices in chosen]


@functools.cache
def tables() -> Tables:
    """The tables, made once; what is arbitrary in them is drawn from fixed seeds."""
    one, two, three, four, eight = (monomials(degree) for degree in (1, 2, 3, 4, 8))
    in_three, in_four, in_eight = ({m: i for i, m in enumerate(each)} for each in (three, four, eight))
    symmetric = np.zeros((4, 4), np.int64)
    symmetric[FIRST, SECOND] = symmetric[SECOND, FIRST] = np.arange(10)
    slopes = np.zeros((10, 4, 4))
    for k, (i, j) in enumerate(zip(FIRST, SECOND, strict=True)):
        slopes[k, i, j] += 1.0
        slopes[k, j, i] += 1.0
    cubic, product = np.zeros((10, 10, 4, 20)), np.zeros((20, 4, 35))
    for j, y in enumerate(one):
        for k, v in enumerate(two):
            cubic[:, k, :, in_three[_times(y, v)]] += slopes[:, :, j]
        for k, v in enumerate(three):
            product[k, j, in_four[_times(y, v)]] += 1.0
    rows = np.array([[in_eight[_times(a, b)] for b in four] for a in four for _ in range(6)])
    minor = np.tile(np.arange(6), 35)
    by_first, by_second, mix = _shifts(in_eight)
    powers = np.array([[in_eight[_times(_power(i, 7), y)] for y in one] for i in range(4)])
    flat = cubic.reshape(100, 80), slopes.reshape(10, 16), product.reshape(80, 35)
    chosen = _chosen(flat, rows, minor)
    return Tables(symmetric, slopes, *flat, rows, minor, chosen, by_first, by_second, mix, powers)


def _chosen(flat: tuple[Array, Array, Array], rows: NDArray[np.int64], minor: NDArray[np.int64]) -> NDArray[np.int64]:
    """Rows of the multiples that pivoting takes first in a random problem; they are independent in almost all."""
    from scipy.linalg import qr

    rng = np.random.default_rng(0)
    A, y = rng.normal(size=(8, 10)), rng.normal(size=4)
    forms = minors(*coefficients(A[None], -(A @ (y[FIRST] * y[SECOND]))[None], *flat[:2]), flat[2])
    _, order = qr(_multiples(forms[0], rows, minor).T, mode="r", pivoting=True)
    return np.sort(order[:RANK]).astype(np.int64)


def _multiples(forms: Array, rows: NDArray[np.int64], minor: NDArray[np.int64]) -> Array:
    """(210, 165) multiples of degree 8 of the (6, 35) minors."""
    matrix = np.zeros((210, 165))
    matrix[np.arange(210)[:, None], rows] = forms[minor]
    return matrix


def _shifts(in_eight: dict[tuple[int, ...], int]) -> tuple[Array, Array, Array]:
    """The monomials of degree 7 times two random linear forms, as rows over degree 8; forty random mixtures of them."""
    rng = np.random.default_rng(1)
    mix = np.linalg.qr(rng.normal(size=(120, PAIRS)))[0].T
    linear = np.linalg.qr(rng.normal(size=(4, 2)))[0]
    shifts = np.zeros((2, 120, 165))
    for j, y in enumerate(monomials(1)):
        for k, m in enumerate(monomials(7)):
            shifts[:, k, in_eight[_times(y, m)]] = linear[j]
    return shifts[0], shifts[1], mix


def coefficients(A: Array, d: Array, cubic: Array, linear: Array) -> tuple[Array, Array]:
    """C (b, 4, 20) and L (b, 4, 4) of the problems A (b, r, 10), d (b, r)."""
    square = np.swapaxes(A, 1, 2) @ A
    mixed = np.swapaxes(A, 1, 2) @ d[..., None]
    return (square.reshape(-1, 100) @ cubic).reshape(-1, 4, 20), (mixed[..., 0] @ linear).reshape(-1, 4, 4)


def minors(C: Array, L: Array, product: Array) -> Array:
    """(b, 6, 35) coefficients of the 2 x 2 minors of [C(y), L y], scaled to unit length."""
    i, j = np.array(list(combinations(range(4), 2))).T
    pairs = C[:, i, :, None] * L[:, j, None, :] - C[:, j, :, None] * L[:, i, None, :]
    forms = pairs.reshape(len(C), 6, 80) @ product
    return forms / np.linalg.norm(forms, axis=2, keepdims=True)


def critical_points(A: Array, d: Array) -> tuple[Array, NDArray[np.int64]]:
    """(b, 40, 4) complex critical points, one of each pair, NaN where lost, and the (b,) number of distinct ones.

    A: (b, r, 10), d: (b, r), scaled so that A v and d are of one size for |y| about 1.
    """
    y, pairs = _search(A, d, A, _quick, POLISH_STEPS)
    again = np.flatnonzero(pairs < PAIRS)
    if len(again):  # about one problem in three thousand
        near = A[again] * (1.0 + JITTER * np.random.default_rng(2).normal(size=A.shape[1:]))
        other, more = _search(A[again], d[again], near, _thorough, MORE_STEPS)
        better = more > pairs[again]
        y[again[better]], pairs[again[better]] = other[better], more[better]
    return y, pairs


def _search(
    A: Array, d: Array, near: Array, dual: Callable[[Array], tuple[Array, Array]], steps: int
) -> tuple[Array, NDArray[np.int64]]:
    """`critical_points` from those of |near v(y) + d|^2."""
    fixed = tables()
    C, L = coefficients(near, d, fixed.cubic, fixed.linear)
    with np.errstate(all="ignore"):
        y = _scaled(_directions(*dual(minors(C, L, fixed.product))), near, d)
        step = np.zeros_like(y)
        for _ in range(steps):
            step = newton_step(y, A, d)
            y = y + step
        size = np.linalg.norm(y, axis=2)
        lost = ~((np.linalg.norm(step, axis=2) <= ROOT_TOL * size) & (size > ZERO))
        pairs = _distinct(y / size[..., None], ~lost)
    y[lost] = np.nan
    return y, pairs


def newton_step(y: Array, A: Array, d: Array) -> Array:
    """(b, k, 4) Newton steps towards a zero of the gradient of |A v(y) + d|^2 from (b, k, 4), real or complex.

    The gradient is formed from the residual, not from A^T A, so that its zero is as exact as the data.
    """
    fixed = tables()
    weights = (_products(y) @ np.swapaxes(A, 1, 2) + d[:, None]) @ A
    curl = weights[..., fixed.symmetric] * (1.0 + np.eye(4))
    slopes = A[:, None] @ (y @ fixed.slopes.reshape(40, 4).T).reshape(*y.shape[:2], 10, 4)
    hessian = curl + np.swapaxes(slopes, 2, 3) @ slopes
    return -solve_or_nan(hessian, curl @ y[..., None])[..., 0]


def _quick(forms: Array) -> tuple[Array, Array]:
    """(b, 165, 40) basis of the functionals that vanish on all multiples of the (b, 6, 35) minors, and (b, 40, 40)
    multiplication by the ratio of the linear forms; from chosen multiples only, by one LU each.
    """
    fixed = tables()
    system = np.zeros((len(forms), 165, 165))
    system[:, np.arange(RANK)[:, None], fixed.rows[fixed.chosen]] = forms[:, fixed.minor[fixed.chosen]]
    system[:, RANK:] = fixed.mix @ fixed.by_second
    right = np.zeros((1, 165, PAIRS))  # a stack of one: NumPy 1 takes two axes beside a stack for a stack of vectors
    right[:, RANK:] = np.eye(PAIRS)
    dual = solve_or_nan(system, right)
    return dual, (fixed.mix @ fixed.by_first) @ dual


def _thorough(forms: Array) -> tuple[Array, Array]:
    """The same from all multiples and all monomials of degree 7, by orthogonal steps."""
    from scipy.linalg import qr

    fixed, b = tables(), len(forms)
    dual, ratio = np.zeros((b, 165, PAIRS)), np.full((b, PAIRS, PAIRS), np.nan)
    for i, six in enumerate(forms):
        if np.all(np.isfinite(six)):
            basis, _, _ = qr(_multiples(six, fixed.rows, fixed.minor).T, pivoting=True)
            dual[i] = basis[:, RANK:]
            ratio[i] = np.linalg.lstsq(fixed.by_second @ dual[i], fixed.by_first @ dual[i], rcond=None)[0]
    return dual, ratio


def _directions(dual: Array, ratio: Array) -> Array:
    """(b, 40, 4) complex unit directions from the eigenvectors of the multiplication."""
    good = np.all(np.isfinite(ratio), axis=(1, 2))
    _, vectors = np.linalg.eig(np.where(good[:, None, None], ratio, np.eye(PAIRS)))
    values = dual[:, tables().powers.ravel()] @ vectors.astype(np.complex128)  # real where all roots are
    values = np.moveaxis(values.reshape(-1, 4, 4, PAIRS), 3, 1)  # (b, 40, i, j) of y_i^7 y_j
    largest = np.argmax(np.abs(np.einsum("bkii->bki", values)), axis=2)
    y = np.take_along_axis(values, largest[..., None, None], axis=2)[:, :, 0]
    return y / np.linalg.norm(y, axis=2, keepdims=True)


def _scaled(y: Array, A: Array, d: Array) -> Array:
    """Directions times the complex length s at which C(s y) + L s y = 0, in the sense of least squares."""
    slopes = tables().slopes.reshape(40, 4).T
    jacobian = (y @ slopes).reshape(*y.shape[:2], 10, 4)
    linear, cubic = (
        (np.swapaxes(jacobian, 2, 3) @ (weights @ A)[..., None])[..., 0]
        for weights in (np.broadcast_to(d[:, None], (*y.shape[:2], d.shape[1])), _products(y) @ np.swapaxes(A, 1, 2))
    )
    square = -np.sum(np.conj(cubic) * linear, axis=2) / np.sum(np.abs(cubic) ** 2, axis=2)
    return y * np.sqrt(square)[..., None]


def _products(y: Array) -> Array:
    return y[..., FIRST] * y[..., SECOND]


def _distinct(directions: Array, found: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Number of found directions that differ from all before them, (b,)."""
    cosine = np.abs(directions @ np.swapaxes(np.conj(directions), 1, 2))
    same = np.tril(1.0 - cosine**2 < DISTINCT, -1)
    return np.sum(found & ~np.any(same, axis=2), axis=1)


def _power(i: int, exponent: int) -> tuple[int, ...]:
    return tuple(exponent if k == i else 0 for k in range(4))


def _times(a: tuple[int, ...], b: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(m + n for m, n in zip(a, b, strict=True))

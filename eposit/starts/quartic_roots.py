"""Real roots of quartics in closed form, many at once."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array

LEAD = 1e-14  # leading over largest coefficient below which a quartic counts as none
POLISH = 3  # Newton steps on each root: the closed form cancels where roots differ much in size


def quartic_roots(rising: list[Array]) -> Array:
    """(4, b) roots of five (b,) coefficients by rising power; of a complex pair its real part, twice.

    Noise turns a double root into a complex pair, and then the real part is a good start. NaN where the leading
    coefficient vanishes.
    Source:
        Descartes' factoring into two real quadratics, of the polynomial without its cubic term.
    """
    with np.errstate(all="ignore"):
        size = np.max(np.abs(np.stack(rising)), axis=0)
        lead = np.where(np.abs(rising[4]) > LEAD * size, rising[4], np.nan)
        d, c, b, a = (coefficient / lead for coefficient in rising[:4])  # y^4 + a y^3 + b y^2 + c y + d
        shift = 0.25 * a
        p = b - 6.0 * shift**2
        q = c - 2.0 * b * shift + 8.0 * shift**3
        r = d - c * shift + b * shift**2 - 3.0 * shift**4
        z = np.maximum(_largest_cubic_root(2.0 * p, p * p - 4.0 * r, -q * q), 0.0)
        w = np.sqrt(z)  # y^4 + p y^2 + q y + r = (y^2 + w y + m - n) (y^2 - w y + m + n)
        m = 0.5 * (p + z)
        n = np.where(z > 1e-12 * (np.abs(p) + np.sqrt(np.abs(r))), 0.5 * q / w, np.sqrt(np.maximum(m * m - r, 0.0)))
        roots, real = np.empty((4, *lead.shape)), np.empty((4, *lead.shape), bool)
        for row, (half, product) in enumerate(((-0.5 * w, m - n), (0.5 * w, m + n))):
            inside = half * half - product
            root = np.sqrt(np.maximum(inside, 0.0))
            far = half + np.where(half < 0.0, -root, root)
            near = np.where(inside > 0.0, product / far, far)  # the product of the roots: no cancellation
            roots[2 * row], roots[2 * row + 1] = far - shift, near - shift
            real[2 * row : 2 * row + 2] = inside > 0.0
        return np.where(real, _polished(rising, roots), roots)


def _largest_cubic_root(a: Array, b: Array, c: Array) -> Array:
    """The largest real root of z^3 + a z^2 + b z + c, by Viete's cosine or Cardano's formula, polished once."""
    third = a / 3.0
    q = third * third - b / 3.0
    r = third**3 - 0.5 * third * b + 0.5 * c
    three = r * r < q**3
    root_q = np.sqrt(np.where(three, q, 1.0))
    angle = np.arccos(np.clip(np.where(three, r / root_q**3, 0.0), -1.0, 1.0))
    cosine = -2.0 * root_q * np.cos((angle + 2.0 * np.pi) / 3.0) - third
    outer = -np.copysign(np.cbrt(np.abs(r) + np.sqrt(np.maximum(r * r - q**3, 0.0))), r)
    cardano = outer + np.where(outer == 0.0, 0.0, q / outer) - third
    z = np.where(three, cosine, cardano)
    for _ in range(2):
        slope = (3.0 * z + 2.0 * a) * z + b
        step = (((z + a) * z + b) * z + c) / slope
        z = np.where(np.abs(step) < 0.01 * np.abs(z), z - step, z)
    return z


def _polished(rising: list[Array], roots: Array) -> Array:
    """Roots after some Newton steps, taken where they shrink the value of the polynomial."""
    value = _evaluate(rising, roots)
    slope_terms = [power * rising[power] for power in range(1, 5)]
    for _ in range(POLISH):
        proposal = roots - value / _evaluate(slope_terms, roots)
        proposed = _evaluate(rising, proposal)
        better = np.abs(proposed) < np.abs(value)
        roots, value = np.where(better, proposal, roots), np.where(better, proposed, value)
    return roots


def _evaluate(rising: list[Array], v: Array) -> Array:
    total = rising[-1] * np.ones_like(v)
    for coefficient in reversed(rising[:-1]):
        total = total * v + coefficient
    return total

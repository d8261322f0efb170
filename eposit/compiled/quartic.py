"""Real roots of a quartic in closed form, polished."""

from __future__ import annotations

import math

from eposit.compiled.kernel import NOTHING, NUMBER, WHOLE, W, compiled

LEAD = 1e-14  # leading over largest coefficient below which a quartic counts as none
POLISH = 3  # Newton steps on each root: the closed form cancels where roots differ much in size


@compiled(NUMBER, NUMBER, NUMBER, NUMBER)
def _largest_cubic_root(a, b, c):
    """The largest real root of z^3 + a z^2 + b z + c, by Viete's cosine or Cardano's formula, polished."""
    third = a / 3.0
    q = third * third - b / 3.0
    r = third * third * third - 0.5 * third * b + 0.5 * c
    q3 = q * q * q
    if r * r < q3:
        root_q = math.sqrt(q)
        angle = math.acos(min(1.0, max(-1.0, r / (root_q * q))))
        z = -2.0 * root_q * math.cos((angle + 2.0 * math.pi) / 3.0) - third
    else:
        outer = -math.copysign((abs(r) + math.sqrt(max(r * r - q3, 0.0))) ** (1.0 / 3.0), r)
        z = outer + (0.0 if outer == 0.0 else q / outer) - third
    for _ in range(2):
        step = (((z + a) * z + b) * z + c) / ((3.0 * z + 2.0 * a) * z + b)
        if abs(step) < 0.01 * abs(z):
            z -= step
    return z


@compiled(NOTHING, W, WHOLE)
def quartic_roots(w, place):
    """At place (4) the roots of the quartic whose five coefficients, by rising power, follow; of a complex pair its
    real part, twice.

    Noise turns a double root into a complex pair, and then the real part is a good start. NaN where the leading
    coefficient vanishes.
    Source:
        Descartes' factoring into two real quadratics, of the polynomial without its cubic term.
    """
    e, d, c = w[place + 4], w[place + 5], w[place + 6]
    b, a = w[place + 7], w[place + 8]
    size = max(max(abs(b), abs(c)), max(abs(d), abs(e)))
    over = 1.0 / a if abs(a) > LEAD * size else math.nan
    shift = 0.25 * b * over
    b2, c2, d2 = c * over, d * over, e * over  # y^4 + 4 shift y^3 + b2 y^2 + c2 y + d2
    p = b2 - 6.0 * shift * shift
    q = c2 - 2.0 * b2 * shift + 8.0 * shift * shift * shift
    r = d2 - c2 * shift + b2 * shift * shift - 3.0 * shift * shift * shift * shift
    z = max(_largest_cubic_root(2.0 * p, p * p - 4.0 * r, -q * q), 0.0)
    half = math.sqrt(z)  # y^4 + p y^2 + q y + r = (y^2 + w y + m - n) (y^2 - w y + m + n) with w this root
    m = 0.5 * (p + z)
    n = 0.5 * q / half if z > 1e-12 * (abs(p) + math.sqrt(abs(r))) else math.sqrt(max(m * m - r, 0.0))
    half, n = -0.5 * half, -n
    for row in range(2):
        inside = half * half - (m + n)
        root = math.sqrt(max(inside, 0.0))
        far = half - root if half < 0.0 else half + root
        near = (m + n) / far if inside > 0.0 else far  # the product of the roots: no cancellation
        for k in range(2):
            v = (far if k == 0 else near) - shift
            if inside > 0.0:
                value = (((a * v + b) * v + c) * v + d) * v + e
                for _ in range(POLISH):
                    proposal = v - value / (((4.0 * a * v + 3.0 * b) * v + 2.0 * c) * v + d)
                    proposed = (((a * proposal + b) * proposal + c) * proposal + d) * proposal + e
                    if abs(proposed) < abs(value):
                        v, value = proposal, proposed
            w[place + 2 * row + k] = v
        half, n = -half, -n

"""Compiled error function and exponential that a compiler can run on several pixels at once. Good to 2e-7."""

from __future__ import annotations

import math

from pipelines.detection.kernels import inlined

FARTHEST = 60.0  # exp(-60) is nothing beside a grey value
GAUSS = math.sqrt(2.0 / math.pi)
HALF_ROOT = math.sqrt(0.5)


@inlined
def decay(u: float) -> float:
    """exp(-u) for u >= 0: the Taylor series of a 64th, raised to the 64th power."""
    y = (u if u < FARTHEST else FARTHEST) * (-1.0 / 64.0)
    e = 1.0 + y * (1.0 + y * (1 / 2 + y * (1 / 6 + y * (1 / 24 + y * (1 / 120 + y * (1 / 720 + y * (1 / 5040)))))))
    e *= e
    e *= e
    e *= e
    e *= e
    e *= e
    return e * e


@inlined
def signed_share(a: float, bell: float) -> float:
    """erf(a / sqrt 2) for a standard normal's a, with `bell` = exp(-a^2 / 2).

    Source:
        Abramowitz and Stegun, formula 7.1.26.
    """
    q = 1.0 / (1.0 + 0.3275911 * HALF_ROOT * abs(a))
    tail = ((((1.061405429 * q - 1.453152027) * q + 1.421413741) * q - 0.284496736) * q + 0.254829592) * q
    return math.copysign(1.0 - tail * bell, a)

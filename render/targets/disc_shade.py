"""How much light a disc above the board keeps from it."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array


def blocked_share(distance: Array, radius: float, height: float) -> Array:
    """Share of an even surrounding's light that a disc blocks at a point below its plane.

    distance: of the point from the disc's axis, any shape. All lengths in one unit.
    Source:
        Howell, catalogue of configuration factors, B-13: a differential element to a parallel disc.
    """
    a2, r2, h2 = distance**2, radius**2, height**2
    return 0.5 * (1.0 - (a2 + h2 - r2) / np.sqrt((a2 + h2 + r2) ** 2 - 4.0 * a2 * r2))

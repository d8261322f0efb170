"""Whether a camera sees the front of a whole target."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from render.targets import Target

PLACES = 9  # along each side of the sheet


def shows_front(target: Target, camera_in_obj: Array) -> bool:
    """Whether every place of the target turns its front to a camera at (3,) mm of the object frame.

    Where that holds no part of a bent board hides another.
    """
    if camera_in_obj[2] >= target.front_mm:
        return False
    if target.sheet.sag_mm == 0.0:
        return True
    x0, x1, y0, y1 = target.sheet.extent_mm
    x, y = np.meshgrid(np.linspace(x0, x1, PLACES), np.linspace(y0, y1, PLACES))
    at = np.stack((x, y), axis=-1)
    return bool(np.all(np.sum(target.sheet.normals(at) * (camera_in_obj - target.sheet.lift(at)), axis=-1) > 0.0))

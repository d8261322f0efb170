"""Colour: the grey that a picture in linear RGB has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # of linear RGB with the primaries of Rec. ITU-R BT.709


def luminance(rgb: NDArray[np.float32]) -> NDArray[np.float32]:
    """(...) luminance of (..., 3) linear RGB; a colour of three equal numbers keeps their value within rounding."""
    red, green, blue = np.moveaxis(rgb, -1, 0)
    return (LUMINANCE[0] * red + LUMINANCE[1] * green + LUMINANCE[2] * blue).astype(np.float32, copy=False)

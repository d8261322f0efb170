"""Pictures of any usual kind as 8 bits of grey, which is what finders and fits read."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array

Grey = NDArray[np.uint8]

SHARES = np.array([0.25, 0.5, 0.25])  # of three channels: the same for red first and blue first
ALONE_SHARE = 0.5  # of the range from least to greatest value: what single pixels take beyond it costs a bit of eight
ALLOWED = "give (height, width) or (height, width, 1, 3 or 4) of 8 or 16 bits, or floating point without NaN"


def grey_picture(image: NDArray[np.generic]) -> Grey:
    """8-bit grey of a grey or colour picture.

    Three channels are red, green and blue or blue, green and red; of a fourth, which is opacity, nothing is taken. What
    is not of 8 bits is stretched from its least to its greatest value, so that all of a 12-bit picture in 16 bits is
    kept that 8 bits can hold; see `_range` for single pixels far beyond the others.

    Raises:
        ValueError: another shape or type, or values that are not finite.
    """
    if image.ndim == 2 and image.dtype == np.uint8 and image.size:
        return np.ascontiguousarray(image, np.uint8)
    usual = image.ndim == 2 or (image.ndim == 3 and image.shape[2] in (1, 3, 4))
    known = image.dtype.kind == "f" or (image.dtype.kind == "u" and image.dtype.itemsize <= 2)
    if not (usual and known and image.size):
        raise ValueError(f"image has shape {image.shape} and type {image.dtype}; {ALLOWED}")
    values = _without_colour(image)
    if image.dtype == np.uint8:
        return np.rint(values).astype(np.uint8)
    low, high = _range(values)
    return np.rint((np.clip(values, low, high) - low) * (255.0 / max(high - low, 1e-300))).astype(np.uint8)


def _range(values: Array) -> tuple[float, float]:
    """Least and greatest value of a picture (height, width).

    Where single pixels take most of what lies between, as a worn sensor's or a lamp's reflections in floating point do,
    those of the medians of 3 x 3 pixels.

    Raises:
        ValueError: values that are not finite.
    """
    low, high = float(values.min()), float(values.max())
    if not np.isfinite(low + high):
        raise ValueError(f"image has values that are not finite; {ALLOWED}")
    medians = cv2.medianBlur(values.astype(np.float32), 3)
    least, greatest = float(medians.min()), float(medians.max())
    return (least, greatest) if greatest - least < ALONE_SHARE * (high - low) else (low, high)


def _without_colour(image: NDArray[np.generic]) -> Array:
    if image.ndim == 2:
        return image.astype(np.float64)
    if image.shape[2] == 1:
        return image[..., 0].astype(np.float64)
    return image[..., :3].astype(np.float64) @ SHARES

"""8-bit images, grey or in colour, as PNG bytes."""

from __future__ import annotations

import struct

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.recipe.cameras import MAX_PIXELS

PNG_START = b"\x89PNG\r\n\x1a\n"
PNG_HEADER_BYTES = 24  # up to width and height


def encode_png(image: NDArray[np.uint8]) -> bytes:
    """PNG bytes of an 8-bit image, (height, width) grey or (height, width, 3) RGB."""
    # Differences of rows, their runs and Huffman's code, without a search for longer repeats: noise has none. The
    # order counts: OpenCV's compression level sets the strategy too.
    settings = [
        *(cv2.IMWRITE_PNG_COMPRESSION, 1),
        *(cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE),
        *(cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_UP),
    ]
    stored = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    return cv2.imencode(".png", stored, settings)[1].tobytes()


def decode_pixels(data: bytes) -> NDArray[np.uint8]:
    """(height, width) grey or (height, width, 3) RGB values of PNG bytes.

    Raises:
        ValueError: not an 8-bit image, grey or in colour.
    """
    if not _is_small_enough(data):
        raise ValueError(f"the image is no PNG of at most {MAX_PIXELS} pixels")
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    if image is None or image.dtype != np.uint8 or not (image.ndim == 2 or image.shape[2:] == (3,)):
        raise ValueError("the image is not an 8-bit PNG, grey or in colour")
    return (image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2RGB)).astype(np.uint8, copy=False)


def _is_small_enough(data: bytes) -> bool:
    """Whether the header of a PNG claims what can be decoded: nothing is allocated for one that claims more."""
    if not data.startswith(PNG_START) or len(data) < PNG_HEADER_BYTES:
        return not data.startswith(PNG_START)  # OpenCV says what is wrong with another file
    width, height = struct.unpack(">II", data[16:PNG_HEADER_BYTES])
    return width * height <= MAX_PIXELS


def decode_png(data: bytes) -> NDArray[np.uint8]:
    """(height, width) grey values of PNG bytes; what OpenCV makes of one in colour.

    Raises:
        ValueError: as `decode_pixels`.
    """
    pixels = decode_pixels(data)
    return pixels if pixels.ndim == 2 else cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY).astype(np.uint8, copy=False)

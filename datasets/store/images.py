"""8-bit images, grey or in colour, as PNG bytes."""

from __future__ import annotations

import struct

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.recipe.cameras import MAX_PIXELS
from datasets.store.silence import silent_library

PNG_START = b"\x89PNG\r\n\x1a\n"
NO_PNG = "the image is not an 8-bit PNG, grey or in colour"
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
    size = png_size(data)
    if size is None:
        raise ValueError(NO_PNG)
    if size[0] * size[1] > MAX_PIXELS:  # nothing is allocated for a picture that claims more
        raise ValueError(f"the image is no PNG of at most {MAX_PIXELS} pixels")
    try:
        with silent_library():
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    if image is None or image.dtype != np.uint8 or not (image.ndim == 2 or image.shape[2:] == (3,)):
        raise ValueError(NO_PNG)
    return (image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2RGB)).astype(np.uint8, copy=False)


def png_size(data: bytes) -> tuple[int, int] | None:
    """Height and width that the header of a PNG claims; None of what is no PNG.

    OpenCV would decode many other formats, whose headers nobody has looked at.
    """
    if not isinstance(data, bytes) or not data.startswith(PNG_START) or len(data) < PNG_HEADER_BYTES:
        return None
    width, height = struct.unpack(">II", data[16:PNG_HEADER_BYTES])
    return height, width


def decode_png(data: bytes) -> NDArray[np.uint8]:
    """(height, width) grey values of PNG bytes; what OpenCV makes of one in colour.

    Raises:
        ValueError: as `decode_pixels`.
    """
    pixels = decode_pixels(data)
    return pixels if pixels.ndim == 2 else cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY).astype(np.uint8, copy=False)

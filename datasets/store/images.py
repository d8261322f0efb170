"""8-bit grey images as PNG bytes."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray


def encode_png(image: NDArray[np.uint8]) -> bytes:
    """PNG bytes of an 8-bit grey image."""
    # Differences of rows, their runs and Huffman's code, without a search for longer repeats: noise has none. The
    # order counts: OpenCV's compression level sets the strategy too.
    settings = [
        *(cv2.IMWRITE_PNG_COMPRESSION, 1),
        *(cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE),
        *(cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_UP),
    ]
    return cv2.imencode(".png", image, settings)[1].tobytes()


def decode_png(data: bytes) -> NDArray[np.uint8]:
    """(height, width) grey values of PNG bytes.

    Raises:
        ValueError: not a grey 8-bit image.
    """
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    if image is None or image.ndim != 2 or image.dtype != np.uint8:
        raise ValueError("the image is not an 8-bit grey PNG")
    return image.astype(np.uint8, copy=False)

"""Write `render/targets/markers.npz`: the bits of OpenCV's marker dictionaries, 1 where a module is white.

`python -m tools.marker_bits` writes the file anew; a test holds it against the OpenCV that is installed.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from render.targets.markers import FILE, LARGEST

MODULE_PX = 4


def opencv_bits(name: str) -> NDArray[np.bool_]:
    """(markers, n, n) bits of an OpenCV dictionary, without the border, row 0 at the top.

    name: such as "4X4_1000" or "APRILTAG_36h11".
    """
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))
    count, side = len(dictionary.bytesList), dictionary.markerSize
    size = MODULE_PX * (side + 2)
    pictures = [dictionary.generateImageMarker(i, size, np.zeros((size, size), np.uint8), 1) for i in range(count)]
    middles = slice(MODULE_PX + MODULE_PX // 2, -MODULE_PX, MODULE_PX)
    return np.stack([picture[middles, middles] > 127 for picture in pictures])


def main() -> None:
    """Write the file."""
    tables = {name: np.packbits(opencv_bits(name).reshape(-1, side * side), axis=1) for name, side in LARGEST.items()}
    np.savez_compressed(FILE, **tables)


if __name__ == "__main__":
    main()

"""Bits of square markers, from a table that is kept beside this file.

The table holds OpenCV's ArUco dictionaries (as of OpenCV 5.0) and the AprilTag family 36h11 in OpenCV's orientation;
`tools/marker_bits.py` wrote it, and a test holds it against the OpenCV that is installed. The renderer itself needs no
OpenCV.
"""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np

from render.targets.lattice import Cells

FILE = Path(__file__).with_name("markers.npz")
# A smaller dictionary of OpenCV has the first markers of the largest one of its size.
LARGEST = {"4X4_1000": 4, "5X5_1000": 5, "6X6_1000": 6, "7X7_1000": 7, "APRILTAG_36h11": 6}
DICTIONARY_SIZES = (50, 100, 250, 1000)
DICTIONARIES = tuple(f"{n}X{n}_{size}" for n in (4, 5, 6, 7) for size in DICTIONARY_SIZES)  # of ArUco markers
TAG_FAMILY = "APRILTAG_36h11"


def marker_count(dictionary: str) -> int:
    """How many markers a dictionary has."""
    return len(_bits(TAG_FAMILY)) if dictionary == TAG_FAMILY else int(dictionary.partition("_")[2])


def marker_bits(dictionary: str, marker: int) -> Cells:
    """(n, n) bits of a marker without its border, row 0 at the top as OpenCV draws it; True where it is white."""
    largest = dictionary if dictionary == TAG_FAMILY else f"{dictionary.partition('_')[0]}_{DICTIONARY_SIZES[-1]}"
    return _bits(largest)[marker]


@functools.cache
def _bits(name: str) -> Cells:
    """(markers, n, n) bits of one of the largest dictionaries."""
    side = LARGEST[name]
    with np.load(FILE) as tables:
        packed = tables[name]
    return np.unpackbits(packed, axis=1, count=side * side).reshape(-1, side, side).astype(bool)

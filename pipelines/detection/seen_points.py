"""What a finder says of a target."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array


@dataclass(frozen=True, slots=True)
class SeenPoints:
    """Some of a target's points in an image, to about a pixel."""

    ids: NDArray[np.integer]  # (k,) rows in the target's `points`, each once
    points_px: Array  # (k, 2)
    finder: str  # which finder saw them
    exchanged: bool = False  # whether black is white in the picture, and white black

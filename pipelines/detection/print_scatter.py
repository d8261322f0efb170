"""What corners scatter beyond the noise of their own pixels, as if the print had put each a little elsewhere."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.detection.corner_scatter import scatter_of_neighbours

STEPS = 12  # of bisecting a ratio of 10^8: to 0.5 % of the deviation
MOST_RATIO = 1e4  # of a printed deviation to the pixels' own


def with_print_scatter(at: Array, missed: Array, covariance: Array, slopes: Array, jacobian: Array) -> Array:
    """(n, 2, 2) covariances with as much print in them, the same along the board for all, as the scatter shows.

    A factor for all, as each corner has beside its own pixels, would leave a corner that its pixels tell well so much
    weight as if the print were better there.

    at: (n, 2) squares. missed: (n, 2) px from a map. covariance: (n, 2, 2) px^2, of the corners' pixels alone. slopes:
    (n, 2, k) of the map. jacobian: (n, 2, 2) px per square.
    """
    of_print = jacobian @ jacobian.transpose(0, 2, 1)
    unit = np.median(np.linalg.det(covariance)) / np.median(np.linalg.det(of_print))
    of_print *= np.sqrt(unit)

    def exceeds(share: float) -> bool:
        return scatter_of_neighbours(at, missed, covariance + share * of_print, slopes) > 1.0

    if not exceeds(0.0):
        return covariance
    low, high = MOST_RATIO**-2, MOST_RATIO**2
    for _ in range(STEPS):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if exceeds(middle) else (low, middle)
    return covariance + np.sqrt(low * high) * of_print

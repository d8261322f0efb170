"""What a night is judged by: each metric's unit, the value that it should have, and the smallest change that matters.

Medians and 95th percentiles of absolute errors, which a report shows, are not among them: they do not see a bias that
is small beside the scatter, nor a stated covariance that is too small. Signed means see the first, normalised squared
errors the second.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from datasets.schema import COMPONENTS


class Kind(StrEnum):
    """Which change of a mean is a change for the worse."""

    SIGNED = "signed"  # should be 0: worse is further from it
    LOGARITHM = "logarithm"  # of an error, which should be small: worse is more
    CALIBRATION = "calibration"  # a normalised squared error, which should be 1: worse is a ratio further from it


@dataclass(frozen=True, slots=True)
class Metric:
    """One number of every frame, whose mean over the poses is judged."""

    name: str
    kind: Kind
    margin: float  # a smaller change of the mean does not matter; a LOGARITHM's and a CALIBRATION's is one of the log
    unit: str
    meaning: str


CORNER_MARGIN_PX = 0.0005  # a tenth of the scatter of a corner at 2 m in the regime `typical`
CIRCLE_MARGIN_PX = 0.005  # the circle's centre scatters ten times as much
MEAN_SQUARE_MARGIN = float(np.log(1.05))
NEES_MARGIN = float(np.log(1.10))
LENGTH_MARGIN = float(np.log(1.05))
POSE_MARGIN_SIGMA = 0.2  # of a pose's stated deviation; nobody who uses one pose sees less
# A fifth of the deviation, 0.1 mm along the depth and 0.01 deg of tilt, of `best` at 2 m in the regime `typical`.
POSITION_MARGIN_MM, ROTATION_MARGIN_DEG = 0.02, 0.002

CORNERS = (
    Metric("corner_x", Kind.SIGNED, CORNER_MARGIN_PX, "px", "mean error of the corners along x"),
    Metric("corner_y", Kind.SIGNED, CORNER_MARGIN_PX, "px", "mean error of the corners along y"),
    Metric("corner_radial", Kind.SIGNED, CORNER_MARGIN_PX, "px", "mean error of the corners along the radius"),
    Metric("corner_log_ms", Kind.LOGARITHM, MEAN_SQUARE_MARGIN, "log px^2", "log of the corners' mean squared error"),
    Metric("corner_nees", Kind.CALIBRATION, NEES_MARGIN, "1", "corners' squared error over its stated covariance"),
    Metric("circle_x", Kind.SIGNED, CIRCLE_MARGIN_PX, "px", "error of the circle's centre along x"),
    Metric("circle_y", Kind.SIGNED, CIRCLE_MARGIN_PX, "px", "error of the circle's centre along y"),
)
POSES = (
    *(
        Metric(f"{name}_normalised", Kind.SIGNED, POSE_MARGIN_SIGMA, "sigma", f"error of {name} over its deviation")
        for name in COMPONENTS
    ),
    Metric("pose_nees", Kind.CALIBRATION, NEES_MARGIN, "1", "six pose errors squared over their covariance"),
    Metric("pose_log_t", Kind.LOGARITHM, LENGTH_MARGIN, "log mm", "log of the length of the translation error"),
    Metric("pose_log_R", Kind.LOGARITHM, LENGTH_MARGIN, "log deg", "log of the angle of the rotation error"),
)
# Of systems that need not state a covariance, whose signed errors would otherwise not be judged.
SIGNED_POSES = (
    *(
        Metric(f"t{axis}_error", Kind.SIGNED, POSITION_MARGIN_MM, "mm", f"error of the position along {axis}")
        for axis in "xyz"
    ),
    *(
        Metric(f"r{axis}_error", Kind.SIGNED, ROTATION_MARGIN_DEG, "deg", f"error of the rotation about {axis}")
        for axis in "xyz"
    ),
)
METRICS = {metric.name: metric for metric in (*CORNERS, *POSES, *SIGNED_POSES)}

"""What of the lens and the shutter decides which rays make a picture, so that it cannot be put in afterwards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True, slots=True, kw_only=True)
class Optics:
    """Lens and shutter beyond the lens law; the defaults are a global shutter.

    Raises:
        ValueError: a value out of range.
    """

    line_time_us: Annotated[
        float,
        "rolling shutter: time from one row's exposure to the next one's, microseconds, during which the pose moves at "
        "its rate; poses are those of the picture's middle row; 0 for a global shutter",
    ] = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.line_time_us <= 1000.0:
            raise ValueError(f"optics line_time_us is {self.line_time_us}; it must lie in 0 to 1000 microseconds")

    @property
    def line_time_s(self) -> float:
        """Time from one row's exposure to the next one's, s."""
        return 1e-6 * self.line_time_us

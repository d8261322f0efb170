"""Qualities of a rendered picture: how finely a pixel is divided where edges meet, and what that leaves of error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

QualityName = Literal["draft", "standard", "reference"]


@dataclass(frozen=True, slots=True)
class Quality:
    """One quality."""

    samples: int  # cells of a pixel that several edges cross, a square number
    grey_levels: float  # largest error of a developed pixel against 4096 cells, tilt 0 to 75 degrees, five boards
    corner_error_px: float  # RMS per axis of detected corners: recipe `accuracy`, eight poses, five lenses


# The corner errors are alike: what is left of them is the rounding to 8 bits.
QUALITIES: dict[QualityName, Quality] = {
    "draft": Quality(16, 2.0, 0.0026),
    "standard": Quality(64, 0.5, 0.0026),
    "reference": Quality(1024, 0.02, 0.0026),
}


def quality_text() -> str:
    """The qualities with samples and errors, one line."""
    return "; ".join(
        f"{name} ({quality.samples} samples, pixels within {quality.grey_levels:g} grey levels, "
        f"corners {quality.corner_error_px:g} px RMS)"
        for name, quality in QUALITIES.items()
    )

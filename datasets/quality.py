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
    corner_error: str  # measured error of detected corners; empty until it is measured


# The one place for the measured corner error of each quality: fill in `corner_error`, for example
# "0.007 px RMS on demo"; `describe` shows it.
QUALITIES: dict[QualityName, Quality] = {
    "draft": Quality(16, 2.0, ""),
    "standard": Quality(64, 0.5, ""),
    "reference": Quality(1024, 0.02, ""),
}


def quality_text() -> str:
    """The qualities with samples and errors, one line."""
    lines: list[str] = []
    for name, quality in QUALITIES.items():
        corners = f", corners {quality.corner_error}" if quality.corner_error else ""
        lines.append(f"{name} ({quality.samples} samples, pixels within {quality.grey_levels:g} grey levels{corners})")
    return "; ".join(lines)

"""What of the lens and the shutter decides which rays make a picture, so that it cannot be put in afterwards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from eposit import Camera
from render.pupil import Pupil

LEAST_FOCAL, MOST_FOCAL = 0.98, 1.02
MOST_APERTURE_MM = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Optics:
    """Lens and shutter beyond the lens law; the defaults are a global shutter and a pinhole for all colours.

    Raises:
        ValueError: a value out of range, or an aperture without a focus.
    """

    line_time_us: Annotated[
        float,
        "rolling shutter: time from one row's exposure to the next one's, microseconds, during which the pose moves at "
        "its rate; poses are those of the picture's middle row; 0 for a global shutter",
    ] = 0.0
    red_focal: Annotated[
        float, "focal length of red light by that of green, which is the camera's: lateral chromatic aberration"
    ] = 1.0
    blue_focal: Annotated[float, "focal length of blue light by that of green"] = 1.0
    aperture_mm: Annotated[
        float, "diameter of the pupil, which is perpendicular to every ray, mm: defocus by distance; 0 for a pinhole"
    ] = 0.0
    focus_mm: Annotated[float | None, "distance from the camera's centre at which all is sharp, mm"] = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.line_time_us <= 1000.0:
            raise ValueError(f"optics line_time_us is {self.line_time_us}; it must lie in 0 to 1000 microseconds")
        for name in ("red_focal", "blue_focal"):
            if not LEAST_FOCAL <= getattr(self, name) <= MOST_FOCAL:
                allowed = f"{LEAST_FOCAL:g} to {MOST_FOCAL:g}"
                raise ValueError(f"optics {name} is {getattr(self, name)}; it must lie in {allowed}")
        if not 0.0 <= self.aperture_mm <= MOST_APERTURE_MM:
            allowed = f"0 to {MOST_APERTURE_MM:g} mm"
            raise ValueError(f"optics aperture_mm is {self.aperture_mm}; it must lie in {allowed}")
        if self.focus_mm is not None and not self.focus_mm > self.aperture_mm:
            raise ValueError(f"optics focus_mm is {self.focus_mm}; it must be larger than aperture_mm")
        if self.aperture_mm > 0.0 and self.focus_mm is None:
            raise ValueError(
                f"optics aperture_mm is {self.aperture_mm} and focus_mm is left out; give the distance that is sharp"
            )

    @property
    def line_time_s(self) -> float:
        """Time from one row's exposure to the next one's, s."""
        return 1e-6 * self.line_time_us

    @property
    def pupil(self) -> Pupil | None:
        """The open pupil; None for a pinhole."""
        if self.aperture_mm == 0.0 or self.focus_mm is None:
            return None
        return Pupil(0.5 * self.aperture_mm, self.focus_mm)

    @property
    def is_chromatic(self) -> bool:
        """Whether colours have focal lengths of their own."""
        return (self.red_focal, self.blue_focal) != (1.0, 1.0)

    def channel_cameras(self, camera: Camera) -> list[Camera]:
        """The cameras of red, green and blue; one for all where they are alike. camera: of green."""
        focal = (self.red_focal, 1.0, self.blue_focal) if self.is_chromatic else (1.0,)
        return [camera.replace(fx=share * camera.fx, fy=share * camera.fy) for share in focal]

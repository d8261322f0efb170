"""A recipe's cameras: the true one, which renders, and the one that a user without calibration would assume."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from eposit import Camera
from eposit.lens import LENS_NAMES, coefficients_text

MAX_PIXELS = 100_000_000
LEAST_FOCAL_PX, MOST_FOCAL_PX = 1.0, 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraSpec:
    """One camera of a recipe: the true one, which renders, and what a user without calibration would assume."""

    name: Annotated[str, "name in tables and on pictures"]
    lens: Annotated[str, "lens law: " + ", ".join(LENS_NAMES)]
    fx: Annotated[float, "true focal length along x, px"]
    fy: Annotated[float, "true focal length along y, px"]
    cx: Annotated[float, "true principal point, px"]
    cy: Annotated[float, "true principal point, px"]
    width: Annotated[int, "image width, px"] = 1600
    height: Annotated[int, "image height, px"] = 1200
    coefficients: Annotated[tuple[float, ...], f"{coefficients_text()}; empty for the other lenses"] = ()
    nominal_f: Annotated[float | None, "nominal focal length, px; the mean of fx and fy if left out"] = None
    max_field_deg: Annotated[
        float | None, "largest angle, degrees, of the board's centre from the optical axis; no limit if left out"
    ] = None

    def __post_init__(self) -> None:
        if not (LEAST_FOCAL_PX <= self.fx <= MOST_FOCAL_PX and LEAST_FOCAL_PX <= self.fy <= MOST_FOCAL_PX):
            allowed = f"{LEAST_FOCAL_PX:g} to {MOST_FOCAL_PX:g} px"
            raise ValueError(f"camera {self.name!r} has fx {self.fx} and fy {self.fy}; both must lie in {allowed}")
        if self.width * self.height > MAX_PIXELS:
            raise ValueError(f"camera {self.name!r} has {self.width} x {self.height} pixels; at most {MAX_PIXELS} work")
        if self.nominal_f is not None and not self.nominal_f > 0.0:
            raise ValueError(f"camera {self.name!r} has nominal_f {self.nominal_f}; it must be above 0 px")
        if self.max_field_deg is not None and not 0.0 <= self.max_field_deg <= 180.0:
            raise ValueError(
                f"camera {self.name!r} has max_field_deg {self.max_field_deg}; it must lie in 0 to 180 degrees"
            )
        self.true_camera()

    def true_camera(self) -> Camera:
        """The camera that renders."""
        return Camera(
            lens=self.lens, fx=self.fx, fy=self.fy, cx=self.cx, cy=self.cy,
            width=self.width, height=self.height, coefficients=self.coefficients,
        )  # fmt: skip

    def nominal_camera(self) -> Camera:
        """Nominal focal length on both axes and the image centre as the principal point."""
        f = 0.5 * (self.fx + self.fy) if self.nominal_f is None else self.nominal_f
        return assumed_camera(self.true_camera(), f)


def assumed_camera(true: Camera, nominal_f: float) -> Camera:
    """What a user without calibration assumes: the nominal focal length, px, and the image centre."""
    return true.replace(fx=nominal_f, fy=nominal_f, cx=true.width / 2.0, cy=true.height / 2.0)

"""The sheet that a pattern is printed on: how the print is scaled and the board bent.

Lengths along the pattern are nominal, as in the drawing. The printer scales them along x and along y; a board that is
not flat carries the print into space. The middle of the board stays in the plane z = 0 of the object frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from eposit.arrays import Array

BendAxis = Literal["x", "y", "both"]
MOST_SAG_SHARE = 0.25  # of half the board's side: half a radian between the middle's normal and the border's
NEWTON_STEPS = 20


@dataclass(frozen=True, slots=True)
class Sheet:
    """A rectangle of print, scaled and bent.

    Bent along x or y it is a part of a cylinder, on which lengths stay as they are. Bent along both it is
    z = sag (1 - (1 - a^2) (1 - b^2)), a and b from -1 to 1 across the board: the four sides lie in one plane, and
    lengths grow by at most 2 (sag / half side)^2 of themselves.
    """

    extent_mm: tuple[float, float, float, float]  # nominal x_min, x_max, y_min, y_max
    scale: tuple[float, float] = (1.0, 1.0)
    sag_mm: float = 0.0  # how far the borders lie behind the middle, seen from the camera; below 0 before it
    axis: BendAxis = "x"

    @property
    def centre(self) -> Array:
        """(2,) of the board after scaling, mm."""
        x0, x1, y0, y1 = self.extent_mm
        return 0.5 * np.array([x0 + x1, y0 + y1]) * self.scale

    @property
    def half_sides(self) -> Array:
        """(2,) half of the board's sides after scaling, along the sheet, mm."""
        x0, x1, y0, y1 = self.extent_mm
        return 0.5 * np.array([x1 - x0, y1 - y0]) * self.scale

    @property
    def curvatures(self) -> Array:
        """(2,) 1/mm of the cylinder along x and along y, 0 where the sheet is not a cylinder."""
        sags = [self.sag_mm if self.axis == axis else 0.0 for axis in ("x", "y")]
        return np.array([_curvature(sag, half) for sag, half in zip(sags, self.half_sides.tolist(), strict=True)])

    @property
    def pillow_mm(self) -> float:
        """The sag where the sheet is bent along both axes, else 0."""
        return self.sag_mm if self.axis == "both" else 0.0

    def lift(self, at: Array) -> Array:
        """(..., 2) nominal places on the print to (..., 3) points in the object frame, mm."""
        along, (kx, ky) = at * self.scale - self.centre, self.curvatures
        a, b = np.moveaxis(along / self.half_sides, -1, 0)
        x, z_x = _arc(along[..., 0], kx)
        y, z_y = _arc(along[..., 1], ky)
        z = z_x + z_y + self.pillow_mm * (a * a + b * b - a * a * b * b)
        return np.stack((x + self.centre[0], y + self.centre[1], z), axis=-1)

    def normals(self, at: Array) -> Array:
        """(..., 3) unit normals at (..., 2) nominal places, out of the board's front: towards -z."""
        along, (kx, ky) = at * self.scale - self.centre, self.curvatures
        (half_x, half_y), pillow = self.half_sides, self.pillow_mm
        a, b = np.moveaxis(along / self.half_sides, -1, 0)
        rise_x = np.tan(kx * along[..., 0]) + 2.0 * pillow * a * (1.0 - b * b) / half_x
        rise_y = np.tan(ky * along[..., 1]) + 2.0 * pillow * b * (1.0 - a * a) / half_y
        normal = np.stack((rise_x, rise_y, -np.ones_like(rise_x)), axis=-1)
        return normal / np.linalg.norm(normal, axis=-1, keepdims=True)

    def check(self, owner: str) -> None:
        """Refuse a sheet that cannot be.

        Raises:
            ValueError: a scale that no printer has, an unknown axis, or more sag than a board bears.
        """
        if not all(0.5 <= scale <= 2.0 for scale in self.scale):
            raise ValueError(f"{owner} print_scale is {list(self.scale)}; both factors must lie in 0.5 to 2")
        bent = {"x": self.half_sides[:1], "y": self.half_sides[1:], "both": self.half_sides}[self.axis]
        most = MOST_SAG_SHARE * float(bent.min())
        if not abs(self.sag_mm) <= most:
            raise ValueError(
                f"{owner} bend_sag_mm is {self.sag_mm}; on a board of this size bent along {self.axis} it must lie in "
                f"{-most:.4g} to {most:.4g} mm"
            )


def _curvature(sag: float, half: float) -> float:
    """1/mm of a circle whose arc of length `half` from its lowest point rises by `sag`, mm."""
    k = 2.0 * sag / half**2
    for _ in range(NEWTON_STEPS if sag else 0):
        rise = _arc(np.array(half), k)[1] - sag
        k -= float(rise) / (0.5 * half**2 * (1.0 - (k * half) ** 2 / 4.0))
    return k


def _arc(length: Array, k: float) -> tuple[Array, Array]:
    """Place along the tangent and rise, mm, after a length on a circle of curvature k, 1/mm."""
    if k == 0.0:
        return length, np.zeros_like(length)
    return np.sin(k * length) / k, 2.0 * np.sin(0.5 * k * length) ** 2 / k

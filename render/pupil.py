"""A lens's open pupil: a disc perpendicular to each ray, in focus at one distance from the camera's centre.

A pixel's chief ray passes the middle of the pupil. Its other rays leave from other places of the pupil and meet the
chief ray at the focus distance: on a sphere about the camera's centre, as fits a lens whose pupil turns with the ray.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from eposit import Camera
from eposit.arrays import Array
from render import backend
from render.device import DeviceFloat

MOST_BLUR_PX = 40.0
RING_PX = 1.7  # between rings of places; keeps an edge, after a point spread of 0.7 px, within 0.2 of 255 levels
LEAST_AHEAD = 1e-3  # of 1 + cos theta; rays straight back have no axes of their own

DeviceVector = tuple[DeviceFloat, DeviceFloat, DeviceFloat]  # camera axes


@dataclass(frozen=True, slots=True)
class Pupil:
    """An open pupil."""

    radius_mm: float
    focus_mm: float  # from the camera's centre to what is sharp

    def blur_radius_px(self, camera: Camera, points_in_cam: Array) -> float:
        """Largest radius of the images of points out of focus, px; 0 where none has an image. points: (n, 3), mm.

        Through a place P of the pupil a point at distance L in direction d has the image of d + P (1/s - 1/L), s the
        focus distance.

        Raises:
            ValueError: it is above MOST_BLUR_PX.
        """
        distance = np.linalg.norm(points_in_cam, axis=1, keepdims=True)
        direction = points_in_cam / distance
        axes = np.stack(pupil_axes(*direction.T), axis=0).transpose(0, 2, 1)
        angle = np.arange(8)[:, None, None] * (np.pi / 4.0)
        places = self.radius_mm * (np.cos(angle) * axes[0] + np.sin(angle) * axes[1])
        through_rim = camera.project(direction + places * (1.0 / self.focus_mm - 1.0 / distance))
        blur = np.linalg.norm(through_rim - camera.project(direction), axis=-1)
        largest = float(np.max(blur, initial=0.0, where=np.isfinite(blur)))
        if largest > MOST_BLUR_PX:
            raise ValueError(
                f"the target is out of focus by up to {largest:.0f} px; at most {MOST_BLUR_PX:g} px work: "
                "set optics focus_mm nearer to its distance, or a smaller aperture_mm"
            )
        return largest

    def places(self, blur_px: float) -> Iterator[tuple[tuple[float, float], float]]:
        """Places of the pupil along its two axes, mm, with weights whose sum is 1, for a mean over the pupil.

        They lie on rings at the squared radii of Gauss and Legendre and at equal angles, symmetric about the middle.
        blur_px: as of `blur_radius_px`.
        """
        rings = 1 + int(np.ceil(blur_px / RING_PX))
        spokes = 4 * (rings + 1)
        nodes, weights = np.polynomial.legendre.leggauss(rings)
        for ring, (node, weight) in enumerate(zip(nodes.tolist(), weights.tolist(), strict=True)):
            radius = self.radius_mm * float(np.sqrt(0.5 * (1.0 + node)))
            for angle in (np.arange(spokes) + 0.5 * (ring % 2)) * (2.0 * np.pi / spokes):
                yield (radius * float(np.cos(angle)), radius * float(np.sin(angle))), 0.5 * weight / spokes


def pupil_axes(x: Array, y: Array, z: Array) -> tuple[Array, Array]:
    """(3, n) axes of the pupil of rays (x, y, z) of unit length: the camera's x and y turned as z to the ray."""
    share = 1.0 / np.maximum(1.0 + z, LEAST_AHEAD)
    return np.stack((1.0 - x * x * share, -x * y * share, -x)), np.stack((-x * y * share, 1.0 - y * y * share, -y))


def pupil_place(direction: DeviceVector, along: tuple[DeviceFloat, DeviceFloat]) -> DeviceVector:
    """A place of the pupil, from the camera's centre in camera axes. along: its two axes, mm; see `pupil_axes`."""
    dr = backend.jit()
    (x, y, z), (a, b) = direction, along
    across = (x * a + y * b) / dr.maximum(1.0 + z, LEAST_AHEAD)
    return a - x * across, b - y * across, -(x * a + y * b)

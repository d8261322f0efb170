"""The target's coverage of pixels, and its paint under a baked light, in closed form."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from eposit.arrays import Array
from render.analytic.device_print import DevicePrint, shaded_print
from render.analytic.device_target import DeviceTarget, shaded_target
from render.analytic.integrate import integrate_shaded
from render.analytic.rays import device_camera
from render.hybrid.bake import BakedLight
from render.hybrid.texels import shade_reach
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region
from render.targets.kinds import AnyTarget

Uploaded = DeviceTarget | DevicePrint
Picture = NDArray[np.float32]  # (height, width) of a region


@dataclass(frozen=True, slots=True, eq=False)
class ClosedLayers:
    """What the closed form says of a region's pixels."""

    filled: Picture  # share of a pixel that the target fills
    disc: Picture  # share that the raised circle fills
    paint: NDArray[np.float32]  # (height, width, 3) radiance of the board's paint, along the normal, by coverage


@dataclass(frozen=True, slots=True, eq=False)
class ClosedTarget:
    """The target uploaded several times, each under another light."""

    everything: Uploaded  # all of radiance 1
    disc: Uploaded | None  # the raised circle of radiance 1, the board black; None for a target without one
    channels: tuple[Uploaded, ...]  # the board under the baked light, the raised circle black
    edges: Uploaded | None  # the board where shadows' edges are

    def layers(self, camera: Camera, cam_from_obj: Pose, region: Region, samples: int) -> ClosedLayers:
        """samples: cells of a pixel that several edges cross, a square number."""
        device = device_camera(camera, cam_from_obj)

        def drawn(target: Uploaded, divided: NDArray[np.bool_] | None = None) -> Picture:
            return integrate_shaded(target, device, camera, region, samples, 0.0, divided)

        divided = None if self.edges is None else drawn(self.edges) > 0.0
        paint = np.stack([drawn(channel, divided) for channel in self.channels], axis=-1)
        filled = drawn(self.everything)
        return ClosedLayers(filled, np.zeros_like(filled) if self.disc is None else drawn(self.disc), paint)


def closed_target(target: AnyTarget, light: BakedLight) -> ClosedTarget:
    """Upload the target under its baked light."""
    ones, zeros = np.ones((2, 2)), np.zeros((2, 2))
    return ClosedTarget(
        _upload(target, ones, 1.0, is_even=True),
        _upload(target, zeros, 1.0, is_even=True) if isinstance(target, Chessboard) else None,
        tuple(_upload(target, light.board[..., i], 0.0) for i in range(light.board.shape[-1])),
        _upload(target, light.edges, 0.0, is_even=True) if light.edges.any() else None,
    )


def _upload(target: AnyTarget, shading: Array, disc_shading: float, *, is_even: bool = False) -> Uploaded:
    """is_even: whether all of it is to have reflectance 1."""
    if isinstance(target, Chessboard):
        board = replace(target, white=1.0, black=1.0, circle=1.0) if is_even else target
        return shaded_target(board, shading, disc_shading, shade_reach(target))
    return shaded_print(target, shading, *((1.0, 1.0) if is_even else (target.white, target.black)))

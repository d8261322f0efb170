"""The target's coverage of pixels, and its paint under a baked light, in closed form."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from eposit.arrays import Array
from render.analytic.device_target import DeviceTarget, shaded_target
from render.analytic.integrate import integrate_shaded
from render.analytic.rays import device_camera
from render.hybrid.bake import BakedLight
from render.hybrid.texels import shade_reach
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region

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

    everything: DeviceTarget  # all of radiance 1
    disc: DeviceTarget  # the raised circle of radiance 1, the board black
    channels: tuple[DeviceTarget, ...]  # the board under the baked light, the raised circle black
    edges: DeviceTarget | None  # the board where shadows' edges are

    def layers(self, camera: Camera, cam_from_obj: Pose, region: Region, samples: int) -> ClosedLayers:
        """samples: cells of a pixel that several edges cross, a square number."""
        device = device_camera(camera, cam_from_obj)

        def drawn(target: DeviceTarget, divided: NDArray[np.bool_] | None = None) -> Picture:
            return integrate_shaded(target, device, camera, region, samples, 0.0, divided)

        divided = None if self.edges is None else drawn(self.edges) > 0.0
        paint = np.stack([drawn(channel, divided) for channel in self.channels], axis=-1)
        return ClosedLayers(drawn(self.everything), drawn(self.disc), paint)


def closed_target(target: Chessboard, light: BakedLight) -> ClosedTarget:
    """Upload the target under its baked light."""
    even, reach = replace(target, white=1.0, black=1.0, circle=1.0), shade_reach(target)
    ones, zeros = np.ones((2, 2)), np.zeros((2, 2))

    def upload(board: Chessboard, shading: Array, disc: float) -> DeviceTarget:
        return shaded_target(board, shading, disc, reach)

    return ClosedTarget(
        upload(even, ones, 1.0),
        upload(even, zeros, 1.0),
        tuple(upload(target, light.board[..., i], 0.0) for i in range(light.board.shape[-1])),
        upload(even, light.edges, 0.0) if light.edges.any() else None,
    )

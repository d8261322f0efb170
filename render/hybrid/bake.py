"""Light on the target, baked: what a white sheet in the board's place would send out, point by point.

A matt board's radiance is its reflectance times this map, whatever the camera. Direct light from lamps and sun has
sharp shadows and little noise; light by other ways is soft and noisy. So each has its own number of rays, each is
smoothed by itself, and the direct light is computed again on a finer grid where a shadow's edge crosses a texel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any  # Any: Mitsuba's objects, whose types depend on its variant

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from render import backend
from render.device import DeviceFloat, DeviceScene, DeviceSpectrum
from render.hybrid.keyed_sampler import keyed_sampler, lattice_numbers
from render.hybrid.outgoing import NUMBERS, direct_light, rest_of_light
from render.hybrid.placement import Placement
from render.hybrid.smooth import NARROW, WIDTHS, noise, smoothed
from render.hybrid.texels import Grid, coarse_grid, disc_grid, fine_grid, magnified, paste
from render.targets.chessboard import Chessboard

REST_SHARE = 4  # a texel has so many times fewer rays for soft light than for direct light
MAX_RAYS = 1 << 22  # in flight
EDGE_SIGMA, EDGE_SHARE = 6.0, 0.02  # a difference of direct light between texels that counts as a shadow's edge
NEAR_SAMPLES = 2  # times as many rays around the raised circle, where averages over many texels would darken the board
DISC_TEXELS = 8  # along each side of the square around the raised circle

Estimator = Callable[[Any, list[DeviceFloat], Any], DeviceSpectrum]


@dataclass(frozen=True, slots=True, eq=False)
class BakedLight:
    """Radiance over reflectance: what a white matt surface would send out."""

    board: NDArray[np.float32]  # (rows, columns, 3) over the target's extent, texel centres
    edges: NDArray[np.float32]  # (rows, columns) above 0 where shadows have edges
    disc: NDArray[np.float32]  # (3,) on the raised circle


@dataclass(frozen=True, slots=True)
class Baker:
    """A scene with the target in it, ready for its light to be baked."""

    scene: DeviceScene
    placement: Placement  # of the target in the scene
    path: Any  # integrator for what follows the first reflection
    sheet: Any  # BSDF of a white board, without gloss
    samples: int  # rays for a texel's direct light, `REST_SHARE` times fewer for the rest
    seed: int  # 32 bits

    def bake(self, target: Chessboard) -> BakedLight:
        """The light on the target's front."""
        coarse, fine = coarse_grid(target), fine_grid(target)
        direct, rest = self._both(coarse, 0)
        board = magnified(_smooth(direct), coarse, fine)
        edges = magnified(_shadow_edges(direct)[..., None], coarse, fine)[..., 0]
        self._refine(board, fine, edges > 0.0)
        board += magnified(_smooth(rest), coarse, fine)
        near, place = disc_grid(target)
        direct, rest = replace(self, samples=NEAR_SAMPLES * self.samples)._both(near, 1)
        paste(board, direct.mean(axis=0) + _smooth(rest, NARROW), place)
        return BakedLight(*(part.astype(np.float32) for part in (board, edges, self._disc(target))))

    def _both(self, grid: Grid, number: int) -> list[Array]:
        """Direct light and the rest of it on a grid, each (2, rows, columns, 3) by two halves of the rays."""
        rays = ((self._direct, self.samples), (self._rest, max(4, self.samples // REST_SHARE)))
        shape = (2, grid.rows, grid.columns, 3)
        return [
            self._light(grid.points(), grid.step, light, samples, 8 * number + i).reshape(shape)
            for i, (light, samples) in enumerate(rays)
        ]

    def _refine(self, board: Array, fine: Grid, edges: NDArray[np.bool_]) -> None:
        """Replace a fine map's direct light where shadows' edges are."""
        if edges.any():
            points = fine.points()[edges.ravel()]
            board[edges] = self._light(points, fine.step, self._direct, self.samples, 16).mean(axis=0)

    def _disc(self, target: Chessboard) -> Array:
        """(3,) mean over the raised circle's front."""
        step = 2.0 * target.circle_radius_mm / DISC_TEXELS
        side = (np.arange(DISC_TEXELS) + 0.5) * step - target.circle_radius_mm
        x, y = (values.ravel() for values in np.meshgrid(side, side))
        inside = np.hypot(x, y) < target.circle_radius_mm - 0.75 * step
        points = target.circle_centre + np.column_stack((x, y, 0.0 * x))[inside]
        direct, rest = (
            self._light(points, (step, step), light, 16 * self.samples, 24 + i)
            for i, light in enumerate((self._direct, self._rest))
        )
        return (direct + rest).mean(axis=(0, 1))

    def _light(self, points: Array, step: tuple[float, float], light: Estimator, samples: int, purpose: int) -> Array:
        """(2, n, 3) light at texels with centres (n, 3) and sides `step`, mm, by two independent halves of the rays."""
        half, found = max(1, samples // 2), []
        size = max(1, MAX_RAYS // (2 * half))
        for first in range(0, len(points), size):
            found.append(self._chunk(points[first : first + size], step, light, half, (purpose, first)))
        return np.concatenate(found, axis=1)

    def _chunk(
        self, points: Array, step: tuple[float, float], light: Estimator, half: int, key: tuple[int, int]
    ) -> Array:
        mi, dr = backend.load(), backend.jit()
        purpose, first = key
        lane = dr.arange(mi.UInt32, 2 * len(points) * half)
        rays = dr.opaque(mi.UInt32, half)  # so that one kernel serves all grids
        place = lane // rays  # texel and half
        ray, texel = lane - place * rays, place >> 1
        seed = dr.opaque(mi.UInt32, (self.seed + 0x9E3779B9 * (purpose + 1)) & 0xFFFFFFFF)
        pixel = place + dr.opaque(mi.UInt32, 2 * first)
        numbers = lattice_numbers(pixel, ray, seed, NUMBERS + 2)
        x, y, z = (dr.gather(mi.Float, backend.upload(column), texel) for column in points.T)
        x += (numbers[NUMBERS] - 0.5) * dr.opaque(mi.Float, step[0])
        y += (numbers[NUMBERS + 1] - 0.5) * dr.opaque(mi.Float, step[1])
        front = mi.Vector3f(0.0, 0.0, -1.0)
        surface = self.placement.surface(mi.Vector3f(x, y, z), front, front)
        value = light(surface, numbers, keyed_sampler(pixel, ray, seed))
        dr.eval(value)
        means = [np.array(dr.block_sum(channel, half), np.float64) / half for channel in value]
        return np.stack(means, axis=-1).reshape(len(points), 2, 3).swapaxes(0, 1)

    def _direct(self, surface: Any, numbers: list[DeviceFloat], sampler: Any) -> DeviceSpectrum:
        return direct_light(self.scene, surface, self.sheet, numbers)

    def _rest(self, surface: Any, numbers: list[DeviceFloat], sampler: Any) -> DeviceSpectrum:
        return rest_of_light(self.scene, self.path, surface, self.sheet, numbers, sampler)


def _smooth(halves: Array, widths: tuple[float, ...] = WIDTHS) -> Array:
    return smoothed(halves.mean(axis=0), noise(halves), widths)


def _shadow_edges(halves: Array) -> Array:
    """(rows, columns) 1 where direct light differs from a neighbour's by more than noise and smooth light explain."""
    light, error2 = halves.mean(axis=(0, 3)), noise(halves).mean(axis=2)
    edges = np.zeros(light.shape)
    for axis in (0, 1):
        step = np.abs(np.diff(light, axis=axis))
        a, b = (np.moveaxis(error2, axis, 0)[part] for part in (slice(1, None), slice(None, -1)))
        limit = EDGE_SIGMA * np.sqrt(np.moveaxis(a + b, 0, axis)) + EDGE_SHARE * light.max()
        found = np.moveaxis((step > limit).astype(float), axis, 0)
        view = np.moveaxis(edges, axis, 0)
        view[1:], view[:-1] = np.maximum(view[1:], found), np.maximum(view[:-1], found)
    return edges

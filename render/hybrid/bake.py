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
from render.hybrid.coat import matt_white
from render.hybrid.keyed_sampler import keyed_sampler, lattice_numbers
from render.hybrid.outgoing import NUMBERS, direct_light, rest_of_light
from render.hybrid.placement import Placement
from render.hybrid.smooth import NARROW, WIDTHS, noise, smoothed
from render.hybrid.texels import Grid, coarse_grid, disc_grid, fine_grid, magnified, paste
from render.targets.chessboard import Chessboard
from render.targets.kinds import AnyTarget
from render.targets.mesh import CHORD_MM
from render.targets.sheet import Sheet

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
    disc: NDArray[np.float32]  # (3,) on the raised circle; zeros for a target without one


@dataclass(frozen=True, slots=True, eq=False)
class Texels:
    """Small pieces of a surface, flat each."""

    centres: Array  # (n, 3) mm
    rises: Array  # (n, 2) change of z along x and along y
    sides: tuple[float, float]  # mm along x and along y

    def part(self, first: int, last: int) -> Texels:
        """Those from number `first` to before `last`."""
        return Texels(self.centres[first:last], self.rises[first:last], self.sides)


@dataclass(frozen=True, slots=True)
class Baker:
    """A scene with the target in it, ready for its light to be baked."""

    scene: DeviceScene
    placement: Placement  # of the target in the scene
    path: Any  # integrator for what follows the first reflection
    sheet: Any  # BSDF of a white board, without gloss
    samples: int  # rays for a texel's direct light, `REST_SHARE` times fewer for the rest
    seed: int  # 32 bits

    def bake(self, target: AnyTarget) -> BakedLight:
        """The light on the target's front."""
        sheet = target.sheet
        coarse, fine = coarse_grid(target), fine_grid(target)
        direct, rest = self._both(sheet, coarse, 0)
        board = magnified(_smooth(direct), coarse, fine)
        edges = magnified(_shadow_edges(direct)[..., None], coarse, fine)[..., 0]
        self._refine(board, sheet, fine, edges > 0.0)
        board += magnified(_smooth(rest), coarse, fine)
        disc = self._around_disc(board, target) if isinstance(target, Chessboard) else np.zeros(3)
        return BakedLight(*(part.astype(np.float32) for part in (board, edges, disc)))

    def _around_disc(self, board: Array, target: Chessboard) -> Array:
        """(3,) light on the raised circle; a fine map gets that of the board around it."""
        near, place = disc_grid(target)
        direct, rest = replace(self, samples=NEAR_SAMPLES * self.samples)._both(target.sheet, near, 1)
        paste(board, direct.mean(axis=0) + _smooth(rest, NARROW), place)
        return self._disc(target)

    def _both(self, sheet: Sheet, grid: Grid, number: int) -> list[Array]:
        """Direct light and the rest of it on a grid, each (2, rows, columns, 3) by two halves of the rays."""
        rays = ((self._direct, self.samples), (self._rest, max(4, self.samples // REST_SHARE)))
        shape = (2, grid.rows, grid.columns, 3)
        return [
            self._light(_texels(sheet, grid.places(), grid.step), light, samples, 8 * number + i).reshape(shape)
            for i, (light, samples) in enumerate(rays)
        ]

    def _refine(self, board: Array, sheet: Sheet, fine: Grid, edges: NDArray[np.bool_]) -> None:
        """Replace a fine map's direct light where shadows' edges are."""
        if edges.any():
            texels = _texels(sheet, fine.places()[edges.ravel()], fine.step)
            board[edges] = self._light(texels, self._direct, self.samples, 16).mean(axis=0)

    def _disc(self, target: Chessboard) -> Array:
        """(3,) mean over the raised circle's front, which is matt on every board."""
        step = 2.0 * target.circle_radius_mm / DISC_TEXELS
        side = (np.arange(DISC_TEXELS) + 0.5) * step - target.circle_radius_mm
        x, y = (values.ravel() for values in np.meshgrid(side, side))
        inside = np.hypot(x, y) < target.circle_radius_mm - 0.75 * step
        points = target.circle_centre + np.column_stack((x, y, 0.0 * x))[inside]
        paper = replace(self, sheet=matt_white())
        texels = Texels(points, np.zeros((len(points), 2)), (step, step))
        direct, rest = (
            paper._light(texels, light, 16 * self.samples, 24 + i)
            for i, light in enumerate((paper._direct, paper._rest))
        )
        return (direct + rest).mean(axis=(0, 1))

    def _light(self, texels: Texels, light: Estimator, samples: int, purpose: int) -> Array:
        """(2, n, 3) light on texels, by two independent halves of the rays."""
        half, found = max(1, samples // 2), []
        size = max(1, MAX_RAYS // (2 * half))
        for first in range(0, len(texels.centres), size):
            found.append(self._chunk(texels.part(first, first + size), light, half, (purpose, first)))
        return np.concatenate(found, axis=1)

    def _chunk(self, texels: Texels, light: Estimator, half: int, key: tuple[int, int]) -> Array:
        mi, dr = backend.load(), backend.jit()
        purpose, first = key
        count = len(texels.centres)
        lane = dr.arange(mi.UInt32, 2 * count * half)
        rays = dr.opaque(mi.UInt32, half)  # so that one kernel serves all grids
        place = lane // rays  # texel and half
        ray, texel = lane - place * rays, place >> 1
        seed = dr.opaque(mi.UInt32, (self.seed + 0x9E3779B9 * (purpose + 1)) & 0xFFFFFFFF)
        pixel = place + dr.opaque(mi.UInt32, 2 * first)
        numbers = lattice_numbers(pixel, ray, seed, NUMBERS + 2)
        columns = (*texels.centres.T, *texels.rises.T)
        x, y, z, rise_x, rise_y = (dr.gather(mi.Float, backend.upload(column), texel) for column in columns)
        across, down = ((numbers[NUMBERS + i] - 0.5) * side for i, side in enumerate(backend.opaque(*texels.sides)))
        place = mi.Vector3f(x + across, y + down, z + rise_x * across + rise_y * down)
        front = dr.normalize(mi.Vector3f(rise_x, rise_y, -1.0))
        surface = self.placement.surface(place, front, front)
        value = light(surface, numbers, keyed_sampler(pixel, ray, seed))
        dr.eval(value)
        means = [np.array(dr.block_sum(channel, half), np.float64) / half for channel in value]
        return np.stack(means, axis=-1).reshape(count, 2, 3).swapaxes(0, 1)

    def _direct(self, surface: Any, numbers: list[DeviceFloat], sampler: Any) -> DeviceSpectrum:
        return direct_light(self.scene, surface, self.sheet, numbers)

    def _rest(self, surface: Any, numbers: list[DeviceFloat], sampler: Any) -> DeviceSpectrum:
        return rest_of_light(self.scene, self.path, surface, self.sheet, numbers, sampler)


def _texels(sheet: Sheet, places: Array, step: tuple[float, float]) -> Texels:
    """Those at nominal places of a sheet, with nominal sides."""
    normals = sheet.normals(places)
    width, height = (side * scale for side, scale in zip(step, sheet.scale, strict=True))
    # The scene's triangles may lie before a bent sheet by what they leave it.
    before = 4.0 * CHORD_MM if sheet.sag_mm else 0.0
    return Texels(sheet.lift(places) + before * normals, -normals[:, :2] / normals[:, 2:], (width, height))


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

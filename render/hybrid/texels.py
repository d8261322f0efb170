"""Grids of texels on the target's sheet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eposit.arrays import Array
from render.light import GRID_SHARE
from render.targets.chessboard import Chessboard
from render.targets.kinds import AnyTarget

PRINT_TEXELS = 1200  # of the fine grid along a printed board's longer side
COARSE_TEXELS = 43200  # of a board, 240 x 180; on the paper's board 5 mm
LEAST_MAGNIFICATION = 5  # of a coarse texel over a fine one
NEAR_HEIGHTS = 4.5  # heights of the raised circle around it: lamps beyond 77 degrees from the normal give little light
FEATHER = 8  # texels over which a finer map takes over from a coarser one


@dataclass(frozen=True, slots=True)
class Grid:
    """Rows and columns of texels, in the print's nominal lengths; x along columns, y along rows, mm."""

    x: float  # of the grid's upper left corner
    y: float
    step: tuple[float, float]  # width and height of a texel
    columns: int
    rows: int

    def places(self) -> Array:
        """(rows * columns, 2) centres, row by row."""
        x, y = np.meshgrid(self.centres(0), self.centres(1))
        return np.stack((x.ravel(), y.ravel()), axis=1)

    def centres(self, axis: int) -> Array:
        """x of the columns (axis 0) or y of the rows (axis 1)."""
        count, low = ((self.columns, self.x), (self.rows, self.y))[axis]
        return low + (np.arange(count) + 0.5) * self.step[axis]


def fine_grid(target: AnyTarget) -> Grid:
    """The texels of `render.light.shading_map`, 1 mm on the paper's board; of a printed board as many."""
    x0, x1, y0, y1 = target.sheet.extent_mm
    is_chess = isinstance(target, Chessboard)
    spacing = GRID_SHARE * target.square_mm if is_chess else max(x1 - x0, y1 - y0) / PRINT_TEXELS
    return _over(target, round((x1 - x0) / spacing), round((y1 - y0) / spacing))


def coarse_grid(target: AnyTarget) -> Grid:
    """A grid for light without shadows' edges, with a number of texels that does not grow with the board."""
    fine = fine_grid(target)
    factor = max(LEAST_MAGNIFICATION, (fine.columns * fine.rows / COARSE_TEXELS) ** 0.5)
    return _over(target, round(fine.columns / factor), round(fine.rows / factor))


def shade_reach(target: Chessboard) -> float:
    """Distance from the circle's axis, mm, within which it shades the board."""
    return target.circle_radius_mm + NEAR_HEIGHTS * target.circle_height_mm


def disc_grid(target: Chessboard) -> tuple[Grid, tuple[slice, slice]]:
    """The part of the fine grid around the raised circle, where light is shaded, and its rows and columns there."""
    fine, reach = fine_grid(target), shade_reach(target)
    bounds: list[tuple[int, int]] = []
    for axis, (count, low) in enumerate(((fine.columns, fine.x), (fine.rows, fine.y))):
        middle = target.circle_centre[axis] - low
        first = max(0, int(np.floor((middle - reach) / fine.step[axis])))
        last = min(count, int(np.ceil((middle + reach) / fine.step[axis])))
        bounds.append((first, last))
    (left, right), (top, bottom) = bounds
    x, y = fine.x + left * fine.step[0], fine.y + top * fine.step[1]
    return Grid(x, y, fine.step, right - left, bottom - top), (slice(top, bottom), slice(left, right))


def magnified(values: Array, coarse: Grid, fine: Grid) -> Array:
    """(rows, columns, channels) of a coarse grid at the texels of a fine one, bilinear, clamped at the border."""
    for axis in (0, 1):
        lines = np.moveaxis(values, 1 - axis, 0)
        place = (fine.centres(axis) - coarse.centres(axis)[0]) / coarse.step[axis]
        place = np.clip(place, 0.0, len(lines) - 1.0)
        first = np.minimum(place.astype(int), len(lines) - 2)
        share = (place - first)[:, None, None]
        values = np.moveaxis(lines[first] * (1.0 - share) + lines[first + 1] * share, 0, 1 - axis)
    return values


def paste(values: Array, patch: Array, place: tuple[slice, slice]) -> None:
    """Put a patch into a map of the same texels; near the patch's border it takes over step by step."""
    rows, columns = (np.minimum(np.arange(1, n + 1), np.arange(n, 0, -1)) for n in patch.shape[:2])
    share = np.clip(np.minimum.outer(rows, columns) / FEATHER, 0.0, 1.0)[..., None]
    values[place] += share * (patch - values[place])


def _over(target: AnyTarget, columns: int, rows: int) -> Grid:
    x0, x1, y0, y1 = target.sheet.extent_mm
    return Grid(x0, y0, ((x1 - x0) / columns, (y1 - y0) / rows), columns, rows)

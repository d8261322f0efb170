"""A printed board under its light, uploaded to the device that renders."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from eposit.arrays import Array
from render import backend
from render.device import DeviceFloat, DeviceIndex
from render.light import Light, sheet_shading_map
from render.targets import Target
from render.targets.lattice import Lattice
from render.targets.printed import MAX_LINES
from render.targets.sheet import Sheet

TABLE = MAX_LINES + 1  # entries of a table of lines, a power of two, so that one kernel serves all patterns
BEYOND_MM = 1e7  # where the lines lie that fill a table
WHITE, BLACK, DISC = 0.0, 1.0, 2.0  # a cell's code; one with a disc is white around it
COARSE = 0.1  # of the board's longer side: what spans a square's part in `board_reflectance.linear_steps`


@dataclass(frozen=True, slots=True)
class DevicePrintAxis:
    """The print along x or along y, in nominal lengths."""

    low: DeviceFloat  # borders of the board with its margin, mm
    high: DeviceFloat
    lines: DeviceFloat  # (TABLE,) rising
    last_line: DeviceIndex  # number of the last one
    texels: DeviceFloat  # of the map of the light


@dataclass(frozen=True, slots=True)
class DeviceSheet:
    """How the print lies in space, along x and along y where there are two."""

    centre: list[DeviceFloat]  # of the scaled board, mm
    per_mm: list[DeviceFloat]  # nominal lengths for one on the sheet
    curvature: list[DeviceFloat]  # 1/mm, of a cylinder
    half_side: list[DeviceFloat]  # mm
    pillow: DeviceFloat  # mm


@dataclass(frozen=True, slots=True)
class DevicePrint:
    """The board under its light as opaque scalars and tables, so that one kernel serves all boards."""

    x: DevicePrintAxis
    y: DevicePrintAxis
    sheet: DeviceSheet
    cells: DeviceFloat  # (rows + 2, columns + 2) codes, row by row, with the margin around
    row_length: DeviceIndex  # columns + 2
    square: DeviceFloat  # mm, the length beyond which a cell of the picture is taken for its centre
    least_gap: DeviceFloat  # mm, between two lines
    disc_radius: DeviceFloat  # mm
    white: DeviceFloat  # reflectance
    black: DeviceFloat
    shading: DeviceFloat  # (rows * columns,) radiance over reflectance, bilinear between texel centres


@functools.lru_cache(maxsize=4)
def device_print(target: Target, light: Light) -> DevicePrint:
    """Upload the board and the map of its light, once."""
    return shaded_print(target, sheet_shading_map(target, light), target.white, target.black)


def shaded_print(target: Target, shading: Array, white_reflectance: float, black_reflectance: float) -> DevicePrint:
    """Upload a board and a map of its light.

    shading: (rows, columns) radiance over reflectance over the sheet's nominal extent, samples at texel centres.
    """
    lattice, sheet = target.lattice(), target.sheet
    x0, x1, y0, y1 = sheet.extent_mm
    rows, columns = shading.shape
    square, gap, radius, white, black = _opaque(
        COARSE * max(x1 - x0, y1 - y0),
        lattice.least_gap_mm,
        lattice.disc_radius_mm,
        white_reflectance,
        black_reflectance,
    )
    return DevicePrint(
        x=_axis(lattice.x_lines, x0, x1, columns),
        y=_axis(lattice.y_lines, y0, y1, rows),
        sheet=_sheet(sheet),
        cells=backend.upload(_codes(lattice, sheet).ravel()),
        row_length=backend.jit().opaque(backend.load().UInt32, len(lattice.x_lines) + 1),
        square=square,
        least_gap=gap,
        disc_radius=radius,
        white=white,
        black=black,
        shading=backend.upload(shading.ravel()),
    )


def _opaque(*values: float) -> list[DeviceFloat]:
    mi, dr = backend.load(), backend.jit()
    return [dr.opaque(mi.Float, float(value)) for value in values]


def _axis(lines: Array, low: float, high: float, texels: int) -> DevicePrintAxis:
    mi, dr = backend.load(), backend.jit()
    table = np.full(TABLE, BEYOND_MM, np.float32)
    table[: len(lines)] = lines
    ends = _opaque(low, high)
    last = dr.opaque(mi.UInt32, len(lines) - 1)
    return DevicePrintAxis(ends[0], ends[1], backend.upload(table), last, _opaque(texels)[0])


def _sheet(sheet: Sheet) -> DeviceSheet:
    return DeviceSheet(
        centre=_opaque(*sheet.centre),
        per_mm=_opaque(*(1.0 / scale for scale in sheet.scale)),
        curvature=_opaque(*sheet.curvatures),
        half_side=_opaque(*sheet.half_sides),
        pillow=_opaque(sheet.pillow_mm)[0],
    )


def _codes(lattice: Lattice, sheet: Sheet) -> Array:
    """The lattice's cells with a ring of margin; where there is none the ring is as the cell beside it.

    A cell of the picture on the board's border mixes what lies on its two sides, and only the board counts.
    """
    codes = np.where(lattice.black, BLACK, np.where(lattice.discs, DISC, WHITE))
    if lattice.x_lines[0] > sheet.extent_mm[0]:
        return np.pad(codes, 1, constant_values=WHITE).astype(np.float32)
    return np.pad(codes, 1, mode="edge").astype(np.float32)

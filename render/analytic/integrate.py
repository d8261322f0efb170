"""The light of a region of the picture: a cell for each pixel, and a grid of cells where edges cross a pixel.

Without edges shading is smooth, and one cell gives a pixel's mean. There is no noise and no random number: a pixel's
value follows from its place in the picture, so that a region has the bits of the whole picture.

Nothing that changes from frame to frame is a literal of a kernel: three kernels serve all poses, regions and cameras
of a lens.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from render import backend
from render.analytic.cells import MANY_EDGES, ONE_EDGE, SMOOTH, Board, sample_cells, uploaded
from render.analytic.image_circle import uploaded_coverage
from render.analytic.rays import DeviceCamera, device_camera
from render.light import Light
from render.targets.chessboard import Target

CHUNK = 1 << 23  # cells in flight; a cell takes 8 bytes
ONE_EDGE_CELLS = 4  # a single straight edge needs one cell; four follow its bend and the light along it


def trace(
    target: Target,
    light: Light,
    camera: Camera,
    cam_from_obj: Pose,
    region: tuple[int, int, int, int],
    samples: int,
) -> NDArray[np.float32]:
    """(height, width) mean radiance of the pixels of a region (x, y, width, height).

    samples: cells of a pixel that several edges cross, a square number.
    """
    mi, dr = backend.load(), backend.jit()
    x, y, width, height = region
    board, view = uploaded(target, light), device_camera(camera, cam_from_obj)
    background = dr.opaque(mi.Float, light.background)
    corner = tuple(dr.opaque(mi.Int32, value) for value in (x, y, width))
    x_px, y_px = _middle(dr.arange(mi.Int32, width * height), corner)
    place = mi.UInt32(mi.Int32(y_px) * dr.opaque(mi.Int32, camera.width) + mi.Int32(x_px))
    seen = dr.gather(mi.Float, uploaded_coverage(camera), place)
    found = sample_cells(board, view, x_px, y_px, mi.Float(1.0))
    picture = found.radiance + background * dr.maximum(seen - found.filled, 0.0)
    crossed = dr.select((seen > 0.0) & (seen < 1.0), MANY_EDGES, dr.select(seen > 0.0, found.crossed, SMOOTH))
    dr.eval(picture, crossed, seen)
    for kind, cells in ((ONE_EDGE, min(samples, ONE_EDGE_CELLS)), (MANY_EDGES, samples)):
        chosen = dr.compress(crossed == kind)
        for begin in range(0, len(chosen), max(1, CHUNK // cells)):
            part = dr.arange(mi.UInt32, min(max(1, CHUNK // cells), len(chosen) - begin))
            pixels = dr.gather(mi.UInt32, chosen, part + dr.opaque(mi.UInt32, begin))
            radiance, filled = _mean(board, view, _middle(mi.Int32(pixels), corner), cells)
            behind = dr.maximum(dr.gather(mi.Float, seen, pixels) - filled, 0.0)
            dr.scatter(picture, radiance + background * behind, pixels)
    return np.array(picture).reshape(height, width)


def _mean(board: Board, view: DeviceCamera, middle: tuple[Any, Any], cells: int) -> tuple[Any, Any]:
    """Mean radiance and mean share of the target of pixels, each divided into `cells`."""
    mi, dr = backend.load(), backend.jit()
    dr.eval(middle)
    side = round(cells**0.5)
    index = dr.arange(mi.UInt32, dr.width(middle) * cells)
    pixel = index // cells
    inner = index - pixel * cells
    row = inner // side
    column = inner - row * side
    size = mi.Float(1.0 / side)
    x_px = dr.gather(mi.Float, middle[0], pixel) + ((mi.Float(column) + 0.5) * size - 0.5)
    y_px = dr.gather(mi.Float, middle[1], pixel) + ((mi.Float(row) + 0.5) * size - 0.5)
    found = sample_cells(board, view, x_px, y_px, size)
    dr.eval(found.radiance, found.filled)
    # Sums over the contiguous block of a pixel's cells: no atomic additions, the same bits every time.
    return tuple(dr.block_sum(value, cells) * (size * size) for value in (found.radiance, found.filled))


def _middle(index: Any, corner: tuple[Any, Any, Any]) -> tuple[Any, Any]:
    """Column and row in the picture, as floats, of pixels of a region, counted row by row.

    corner: x, y and width of the region. The processor divides floats eight at a time and integers one by one; a
    float quotient is off by one at most.
    """
    mi, dr = backend.load(), backend.jit()
    x, y, width = corner
    row = mi.Int32(mi.Float(index) / mi.Float(width))
    column = index - row * width
    row += dr.select(column >= width, 1, 0) - dr.select(column < 0, 1, 0)
    return mi.Float(index - row * width + x), mi.Float(row + y)

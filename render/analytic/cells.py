"""What one small cell of the picture sees of the target, in Dr.Jit: its mean radiance, by closed forms.

One ray goes through the cell's middle and meets the planes of the circle and of the board. With the ray's change
over the cell every edge is a straight line across the cell, whose share on either side is known (`edge_coverage`).
Where several edges cross one cell, their shares are multiplied as if they were independent.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from render import backend
from render.analytic.edge_coverage import half_reach, share_beyond
from render.analytic.rays import Bundle, DeviceCamera
from render.light import Light, shading_map, shadow_radius
from render.targets.chessboard import Target

EDGE_REACH = 1.1  # of half a pixel: how near an edge counts as crossing it; within it a lens bends by a percent
FAR = 1e6  # mm; what lies farther, or is not finite, is taken for this
LINEAR_SQUARES = 2.0  # a cell that reaches farther on the board is taken for the point in its middle
SMOOTH, ONE_EDGE, MANY_EDGES = 0, 1, 2  # what crosses a pixel


@dataclass(frozen=True, slots=True)
class Board:
    """The target under its light, uploaded: opaque scalars, lengths in mm."""

    extent: list[Any]  # x_min, x_max, y_min, y_max with the margin
    squares: list[Any]  # x and y where the squares begin, side of a square, columns, rows
    reflectance: list[Any]  # white, black
    circle: list[Any]  # x, y, z of the centre, radius, radiance, radius of its shade
    shading: Any  # Float, rows * columns: radiance over reflectance, bilinear between texel centres
    texels: list[Any]  # columns and rows of `shading`


@dataclass(frozen=True, slots=True)
class CellSample:
    """What cells see."""

    radiance: Any  # Float, of the target alone: a cell that it fills by half has half
    filled: Any  # Float, the target's share of the cell
    crossed: Any  # UInt32: SMOOTH, ONE_EDGE or MANY_EDGES


@dataclass(frozen=True, slots=True)
class Hit:
    """Where rays meet a plane of constant z."""

    x: Any  # mm
    y: Any
    steps_x: tuple[Any, Any]  # changes of x over the cell's width and height, mm
    steps_y: tuple[Any, Any]
    met: Any  # Bool, whether the plane lies ahead


@functools.lru_cache(maxsize=4)
def uploaded(target: Target, light: Light) -> Board:
    """The target and the map of its light, made once."""
    mi, dr = backend.load(), backend.jit()

    def up(*values: float) -> list[Any]:
        return [dr.opaque(mi.Float, float(value)) for value in values]

    shading, circle = shading_map(target, light)
    rows, columns = shading.shape
    return Board(
        extent=up(*target.extent_mm),
        squares=up(-target.square_mm, -target.square_mm, target.square_mm, target.columns, target.rows),
        reflectance=up(target.white, target.black),
        circle=up(*target.circle_centre, target.circle_radius_mm, circle * target.circle, shadow_radius(target, light)),
        shading=mi.Float(shading.astype(np.float32).ravel()),
        texels=up(columns, rows),
    )


def sample_cells(board: Board, view: DeviceCamera, x_px: Any, y_px: Any, size: Any) -> CellSample:
    """What cells see whose middles are at x_px, y_px and whose sides are `size`, px."""
    mi, dr = backend.load(), backend.jit()
    rays = view.rays(x_px, y_px)
    cx, cy, cz, radius, circle_radiance, shade = board.circle
    hit = _meet(view, rays, cz, size)
    distance, *toward = _polar(hit, cx, cy)
    circle = share_beyond(radius - distance, *_drop_nonlinear_steps(toward, board))
    circle = dr.select(hit.met, circle, 0.0)
    rim = hit.met & (dr.abs(distance - radius) <= EDGE_REACH * half_reach(*toward))
    under_circle = hit.met & ~rim & (distance < radius)
    hit = _meet(view, rays, 0.0, size)
    reflectance, on_board, lines = _board(board, hit)
    distance, *toward = _polar(hit, cx, cy)
    shaded = distance <= shade + EDGE_REACH * half_reach(*toward)
    lines = dr.select(hit.met, dr.select(shaded, MANY_EDGES, lines), SMOOTH)
    crossed = dr.select(rim, MANY_EDGES, dr.select(under_circle, SMOOTH, lines))
    board_share = (1.0 - circle) * dr.select(hit.met, on_board, 0.0)
    radiance = circle * circle_radiance + board_share * reflectance * _shading(board, hit)
    front = rays.direction.z > 0.0  # a back side is black
    seen = dr.select(rays.seen, 1.0, 0.0)
    return CellSample(dr.select(front, radiance, 0.0) * seen, (circle + board_share) * seen, mi.UInt32(crossed))


def _meet(view: DeviceCamera, rays: Bundle, z: Any, size: Any) -> Hit:
    """Where rays meet the plane at z, mm."""
    dr = backend.jit()
    direction = rays.direction
    inverse = 1.0 / direction.z
    length = (z - view.origin[2]) * inverse
    x, y = view.origin[0] + length * direction.x, view.origin[1] + length * direction.y
    slope_x, slope_y, scale = direction.x * inverse, direction.y * inverse, length * size
    ahead = (rays.along_x, rays.along_y)
    return Hit(
        x=dr.select(dr.abs(x) < FAR, x, FAR),
        y=dr.select(dr.abs(y) < FAR, y, FAR),
        steps_x=tuple(scale * (along.x - slope_x * along.z) for along in ahead),
        steps_y=tuple(scale * (along.y - slope_y * along.z) for along in ahead),
        met=length > 0.0,
    )


def _polar(hit: Hit, x: Any, y: Any) -> tuple[Any, Any, Any]:
    """Distance of hits from a point of their plane, and its changes over the cell's width and height."""
    dr = backend.jit()
    dx, dy = hit.x - x, hit.y - y
    distance = dr.sqrt(dx * dx + dy * dy)
    inverse = dr.select(distance > 0.0, 1.0 / distance, 0.0)
    ux, uy = dx * inverse, dy * inverse
    return distance, *(ux * a + uy * b for a, b in zip(hit.steps_x, hit.steps_y, strict=True))


def _drop_nonlinear_steps(steps: Sequence[Any], board: Board) -> list[Any]:
    """Changes over a cell, or none where they are too large to be taken for linear: near a plane's horizon."""
    dr = backend.jit()
    fine = half_reach(*steps) <= LINEAR_SQUARES * board.squares[2]
    return [dr.select(fine, step, 0.0) for step in steps]


def _board(board: Board, hit: Hit) -> tuple[Any, Any, Any]:
    """The board's mean reflectance in a cell, its share of the cell, and how many of its edges cross."""
    dr = backend.jit()
    first_x, first_y, square, columns, rows = board.squares
    x0, x1, y0, y1 = board.extent
    inside, sign, near, border_near, on_squares, on_board, share = [], [], [], [], [], [], 1.0
    for value, raw_steps, first, count, low, high in (
        (hit.x, hit.steps_x, first_x, columns, x0, x1),
        (hit.y, hit.steps_y, first_y, rows, y0, y1),
    ):
        reach, steps = EDGE_REACH * half_reach(*raw_steps), _drop_nonlinear_steps(raw_steps, board)
        border = dr.minimum(value - low, high - value)
        share *= share_beyond(border, *steps)
        border_near.append(dr.select(dr.abs(border) <= reach, ONE_EDGE, SMOOTH))
        on_board.append(border >= -reach)
        line = dr.clip(dr.round((value - first) / square), 0.0, count)
        offset = value - first - line * square
        beyond = share_beyond(offset, *steps)
        even = 1.0 - 2.0 * (line - 2.0 * dr.floor(0.5 * line))  # +1 where the square beyond the line has even number
        begins, ends = line == 0.0, line == count
        inside.append(dr.select(begins, beyond, dr.select(ends, 1.0 - beyond, 1.0)))
        sign.append(dr.select(begins, beyond, dr.select(ends, even * (beyond - 1.0), even * (2.0 * beyond - 1.0))))
        # A pixel that covers a quarter of a square may hold two lines.
        near.append(dr.select(dr.abs(offset) <= reach, dr.select(4.0 * reach > square, MANY_EDGES, ONE_EDGE), SMOOTH))
        on_squares.append((value >= first - reach) & (value <= first + count * square + reach))
    black = 0.5 * (inside[0] * inside[1] + sign[0] * sign[1])  # column and row both even, or both odd
    white_r, black_r = board.reflectance
    edges = [
        dr.select(on, found, SMOOTH)
        for found, on in zip((*near, *border_near), (*on_squares[::-1], *on_board[::-1]), strict=True)
    ]
    return white_r + (black_r - white_r) * black, share, dr.minimum(sum(edges), MANY_EDGES)


def _shading(board: Board, hit: Hit) -> Any:
    """Radiance over reflectance at points of the board: bilinear in the map, clamped at its border."""
    mi, dr = backend.load(), backend.jit()
    columns, rows = board.texels
    x0, x1, y0, y1 = board.extent
    u = dr.clip((hit.x - x0) * (columns / (x1 - x0)) - 0.5, 0.0, columns - 1.0)
    v = dr.clip((hit.y - y0) * (rows / (y1 - y0)) - 0.5, 0.0, rows - 1.0)
    left, top = dr.minimum(dr.floor(u), columns - 2.0), dr.minimum(dr.floor(v), rows - 2.0)
    across, down = u - left, v - top
    width = mi.Int32(columns)
    first = mi.UInt32(mi.Int32(top) * width + mi.Int32(left))
    below = first + mi.UInt32(width)
    a, b, c, d = (dr.gather(mi.Float, board.shading, i) for i in (first, first + 1, below, below + 1))
    upper, lower = a + across * (b - a), c + across * (d - c)
    return upper + down * (lower - upper)

"""A cell's share of the flat board and its mean reflectance there, in Dr.Jit.

Board and squares are products: what a cell sees follows from x alone and from y alone.
"""

from __future__ import annotations

from dataclasses import dataclass

from render import backend
from render.analytic.device_print import DevicePrint
from render.analytic.device_target import DeviceAxis, DeviceTarget
from render.analytic.edge_coverage import half_range, positive_share
from render.analytic.plane_hit import PlaneHit, Steps
from render.device import DeviceBool, DeviceFloat, DeviceInt

EDGE_REACH = 1.1  # of half a pixel: how near an edge counts as crossing it; within it a lens bends by a percent
LINEAR_SQUARES = 2.0  # a cell that reaches farther on the board is taken for the point in its centre
SMOOTH, ONE_EDGE, MANY_EDGES = 0, 1, 2  # what crosses a pixel


@dataclass(frozen=True, slots=True)
class BoardSample:
    """What cells see of the flat board."""

    reflectance: DeviceFloat  # mean over the cell
    share: DeviceFloat  # of the cell that the board fills
    edges: DeviceInt  # SMOOTH, ONE_EDGE or MANY_EDGES: lines and borders that cross the cell


@dataclass(frozen=True, slots=True)
class _AxisSample:
    """What cells see of the board along x or along y."""

    board: DeviceFloat  # share between the board's borders
    squares: DeviceFloat  # share between the first line and the last
    even_less_odd: DeviceFloat  # share in squares of even number, less the share in those of odd number
    lines: DeviceInt  # how many lines cross the cell: SMOOTH, ONE_EDGE or MANY_EDGES
    borders: DeviceInt  # SMOOTH or ONE_EDGE
    touches_squares: DeviceBool
    touches_board: DeviceBool


def sample_board(target: DeviceTarget, hit: PlaneHit) -> BoardSample:
    """The board's mean reflectance in a cell, its share of the cell, and how many of its edges cross.

    A square is black where column and row are both even or both odd.
    """
    dr = backend.jit()
    x = _sample_axis(target, target.x, hit.x, hit.steps_x)
    y = _sample_axis(target, target.y, hit.y, hit.steps_y)
    black = 0.5 * (x.squares * y.squares + x.even_less_odd * y.even_less_odd)
    # A line along y is only as long as the squares reach along y.
    edges = (
        dr.select(y.touches_squares, x.lines, SMOOTH)
        + dr.select(x.touches_squares, y.lines, SMOOTH)
        + dr.select(y.touches_board, x.borders, SMOOTH)
        + dr.select(x.touches_board, y.borders, SMOOTH)
    )
    reflectance = target.white + (target.black - target.white) * black
    return BoardSample(reflectance, x.board * y.board, dr.minimum(edges, MANY_EDGES))


def _sample_axis(target: DeviceTarget, axis: DeviceAxis, value: DeviceFloat, all_steps: Steps) -> _AxisSample:
    """value: x or y of the cell's centre, mm. all_steps: its changes over the cell."""
    dr = backend.jit()
    square, count, first = target.square, axis.squares, axis.first_line
    reach, steps = EDGE_REACH * half_range(*all_steps), linear_steps(all_steps, target)
    border = dr.minimum(value - axis.low, axis.high - value)
    line = dr.clip(dr.round((value - first) / square), 0.0, count)  # the nearest line
    offset = value - first - line * square
    beyond = positive_share(offset, *steps)
    even = 1.0 - 2.0 * (line - 2.0 * dr.floor(0.5 * line))  # +1 where the square beyond the line has even number
    begins, ends = line == 0.0, line == count
    inner = dr.select(ends, even * (beyond - 1.0), even * (2.0 * beyond - 1.0))
    # A pixel that covers a quarter of a square may hold two lines.
    crossing = dr.select(4.0 * reach > square, MANY_EDGES, ONE_EDGE)
    return _AxisSample(
        board=positive_share(border, *steps),
        squares=dr.select(begins, beyond, dr.select(ends, 1.0 - beyond, 1.0)),
        even_less_odd=dr.select(begins, beyond, inner),
        lines=dr.select(dr.abs(offset) <= reach, crossing, SMOOTH),
        borders=dr.select(dr.abs(border) <= reach, ONE_EDGE, SMOOTH),
        touches_squares=(value >= first - reach) & (value <= first + count * square + reach),
        touches_board=border >= -reach,
    )


def linear_steps(steps: Steps, target: DeviceTarget | DevicePrint) -> Steps:
    """Changes over a cell, or none where they are too large to be taken for linear: near a plane's horizon."""
    dr = backend.jit()
    linear = half_range(*steps) <= LINEAR_SQUARES * target.square
    across, down = steps
    return dr.select(linear, across, 0.0), dr.select(linear, down, 0.0)

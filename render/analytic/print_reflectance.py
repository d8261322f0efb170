"""A cell's share of a printed board and its mean reflectance there, in Dr.Jit.

The four cells of the lattice around the nearest crossing of lines are looked up; a line between equal ones is no edge.
"""

from __future__ import annotations

from dataclasses import dataclass

from render import backend
from render.analytic.board_reflectance import EDGE_REACH, MANY_EDGES, ONE_EDGE, SMOOTH, BoardSample, linear_steps
from render.analytic.device_print import BLACK, DISC, TABLE, DevicePrint, DevicePrintAxis
from render.analytic.edge_coverage import half_range, positive_share
from render.analytic.plane_hit import PlaneHit, Steps, distance_from
from render.device import DeviceBool, DeviceFloat, DeviceIndex, DeviceInt

MANY_LINES = 4.0  # a cell of the picture that reaches over a quarter of a gap may hold two lines


@dataclass(frozen=True, slots=True)
class _AxisSample:
    """What cells see of the print along x or along y."""

    board: DeviceFloat  # share between the board's borders
    border_crosses: DeviceBool
    touches_board: DeviceBool
    line: DeviceIndex  # number of the nearest line, and of the cell before it, the margin counted first
    beyond: DeviceFloat  # share beyond that line
    line_crosses: DeviceBool
    is_beyond: DeviceBool  # whether the centre is
    low: DeviceFloat  # lines around the centre, mm
    high: DeviceFloat
    crowded: DeviceBool  # whether several lines may cross


def sample_print(target: DevicePrint, hit: PlaneHit) -> BoardSample:
    """The board's mean reflectance in a cell, its share of the cell, and how many of its edges cross."""
    dr = backend.jit()
    x = _sample_axis(target, target.x, hit.x, hit.steps_x)
    y = _sample_axis(target, target.y, hit.y, hit.steps_y)
    codes = [[_code(target, x.line + i, y.line + j) for i in (0, 1)] for j in (0, 1)]
    own_upper, own_lower = (dr.select(x.is_beyond, row[1], row[0]) for row in codes)
    own = dr.select(y.is_beyond, own_lower, own_upper)
    (a, b), (c, d) = ([dr.select(code == BLACK, 1.0, 0.0) for code in row] for row in codes)
    upper, lower = a + x.beyond * (b - a), c + x.beyond * (d - c)
    disc, rim = _sample_disc(target, x, y, hit, own == DISC)
    dark = upper + y.beyond * (lower - upper) + disc
    edges = _count_edges(x, y, (a, b), (c, d))
    many = x.touches_board & y.touches_board & (rim | x.crowded | y.crowded)
    reflectance = target.white + (target.black - target.white) * dark
    return BoardSample(reflectance, x.board * y.board, dr.select(many, MANY_EDGES, edges))


def _count_edges(
    x: _AxisSample, y: _AxisSample, upper: tuple[DeviceFloat, DeviceFloat], lower: tuple[DeviceFloat, DeviceFloat]
) -> DeviceInt:
    """How many edges cross cells: SMOOTH, ONE_EDGE or MANY_EDGES.

    upper, lower: darkness before and beyond the nearest line along x, on the two sides of the nearest line along y. A
    line counts where it parts black from white in a row or column that the cell touches.
    """
    dr = backend.jit()
    (a, b), (c, d) = upper, lower
    in_upper, in_lower = y.line_crosses | ~y.is_beyond, y.line_crosses | y.is_beyond
    in_left, in_right = x.line_crosses | ~x.is_beyond, x.line_crosses | x.is_beyond
    crossed = (
        x.line_crosses & (((a != b) & in_upper) | ((c != d) & in_lower)),
        y.line_crosses & (((a != c) & in_left) | ((b != d) & in_right)),
        x.border_crosses & y.touches_board,
        y.border_crosses & x.touches_board,
    )
    first, second, third, fourth = (dr.select(crosses, ONE_EDGE, SMOOTH) for crosses in crossed)
    return dr.minimum(first + second + third + fourth, MANY_EDGES)


def _sample_axis(target: DevicePrint, axis: DevicePrintAxis, value: DeviceFloat, all_steps: Steps) -> _AxisSample:
    """value: nominal x or y of the cell's centre, mm. all_steps: its changes over the cell."""
    mi, dr = backend.load(), backend.jit()
    reach, steps = EDGE_REACH * half_range(*all_steps), linear_steps(all_steps, target)
    border = dr.minimum(value - axis.low, axis.high - value)
    before = _lines_before(axis, value)
    following = dr.minimum(before, axis.last_line)
    previous = dr.maximum(mi.Int32(before) - 1, 0)
    low, high = dr.gather(mi.Float, axis.lines, mi.UInt32(previous)), dr.gather(mi.Float, axis.lines, following)
    nearer_low = dr.abs(value - low) <= dr.abs(high - value)
    offset = value - dr.select(nearer_low, low, high)
    return _AxisSample(
        board=positive_share(border, *steps),
        border_crosses=dr.abs(border) <= reach,
        touches_board=border >= -reach,
        line=dr.select(nearer_low, mi.UInt32(previous), following),
        beyond=positive_share(offset, *steps),
        line_crosses=dr.abs(offset) <= reach,
        is_beyond=offset >= 0.0,
        low=low,
        high=high,
        crowded=MANY_LINES * reach > target.least_gap,
    )


def _lines_before(axis: DevicePrintAxis, value: DeviceFloat) -> DeviceIndex:
    """How many lines lie at or before a value, by halving."""
    mi, dr = backend.load(), backend.jit()
    count, step = dr.zeros(mi.UInt32, dr.width(value)), TABLE // 2
    while step:
        count = dr.select(dr.gather(mi.Float, axis.lines, count + (step - 1)) <= value, count + step, count)
        step //= 2
    return count


def _code(target: DevicePrint, column: DeviceIndex, row: DeviceIndex) -> DeviceFloat:
    return backend.jit().gather(backend.load().Float, target.cells, row * target.row_length + column)


def _sample_disc(
    target: DevicePrint, x: _AxisSample, y: _AxisSample, hit: PlaneHit, has_disc: DeviceBool
) -> tuple[DeviceFloat, DeviceBool]:
    """The share of cells in the disc of the lattice's cell, and whether its rim crosses them."""
    dr = backend.jit()
    distance, steps = distance_from(hit, 0.5 * (x.low + x.high), 0.5 * (y.low + y.high))
    inside = target.disc_radius - distance
    share = positive_share(inside, *(linear_steps(steps, target)))
    return dr.select(has_disc, share, 0.0), has_disc & (dr.abs(inside) <= EDGE_REACH * half_range(*steps))

"""Shares of small cells of the picture that lie beyond an edge, in Dr.Jit.

A cell is a small rectangle of the picture. Over it a distance to an edge is close to linear: value + along_x s +
along_y t with s and t in -1/2 to 1/2. The share where that is positive has a closed form, so that a cell says of an
edge what thousands of random rays would, without their noise.
"""

from __future__ import annotations

from render import backend
from render.device import DeviceFloat


def positive_share(value: DeviceFloat, along_x: DeviceFloat, along_y: DeviceFloat) -> DeviceFloat:
    """Share, 0 to 1, of a cell where value + along_x s + along_y t is positive.

    value: at the cell's centre. along_x, along_y: its change over the cell's width and height. What is not finite
    counts as all on the value's side.
    """
    dr = backend.jit()
    a, b = dr.abs(along_x), dr.abs(along_y)
    longer, shorter = dr.maximum(a, b), dr.minimum(a, b)
    distance = dr.abs(value)
    short_of = 0.5 * (longer + shorter) - distance  # how far the edge is from leaving the cell at its last corner
    cut = 0.5 - short_of * short_of / (2.0 * longer * shorter)  # the edge cuts off a triangle
    straight = distance / longer  # the edge crosses two opposite sides
    share = dr.select(distance <= 0.5 * (longer - shorter), straight, cut)
    share = dr.select((short_of > 0.0) & (share < 0.5), share, 0.5)
    return 0.5 + dr.select(value < 0.0, -share, share)


def half_range(along_x: DeviceFloat, along_y: DeviceFloat) -> DeviceFloat:
    """The largest change of a linear quantity from a cell's centre to its corners."""
    dr = backend.jit()
    return 0.5 * (dr.abs(along_x) + dr.abs(along_y))

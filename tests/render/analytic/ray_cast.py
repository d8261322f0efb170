"""Boards drawn by brute force: rays on a fine grid in each pixel, each black or white. Nothing of the renderer is used.

Geometry is worked out in another way than there: a cylinder is a quadratic equation, a bowl is met by bisection.
"""

import numpy as np


def coverage(target, camera, pose, region, side):
    """(height, width) shares of the board and of its black in the pixels of a region, by side x side rays a pixel."""
    grid = (np.arange(side) + 0.5) / side - 0.5
    x = (region.x + np.arange(region.width))[:, None] + grid
    board, black = np.zeros((2, region.height, region.width))
    eye = -pose.R.T @ pose.t
    for row in range(region.height):
        y = region.y + row + grid
        pixels = np.stack(np.broadcast_arrays(x.ravel()[None, :], y[:, None]), axis=-1).reshape(-1, 2)
        at = _on_print(target, eye, camera.bearing(pixels) @ pose.R)
        on, dark = _is_on_board(target, at), _is_black(target, at)
        board[row], black[row] = (hit.reshape(side, region.width, side).mean(axis=(0, 2)) for hit in (on, on & dark))
    return board, black


def _on_print(target, eye, rays):
    """(n, 2) nominal places that rays meet, NaN where they miss."""
    sheet = target.sheet
    x0, x1, y0, y1 = sheet.extent_mm
    scale = np.array(sheet.scale)
    middle = np.array([x0 + x1, y0 + y1]) / 2.0 * scale
    half = np.array([x1 - x0, y1 - y0]) / 2.0 * scale
    start = eye - [*middle, 0.0]
    with np.errstate(all="ignore"):
        if not sheet.sag_mm:
            place = start + (-start[2] / rays[:, 2])[:, None] * rays
            return (place[:, :2] + middle) / scale
        if sheet.axis == "both":
            return (_meet_bowl(start, rays, half, sheet.sag_mm) + middle) / scale
        axis = "xy".index(sheet.axis)
        along = _meet_cylinder(start, rays, axis, half[axis], sheet.sag_mm)
        return (along + middle) / scale


def _meet_cylinder(start, rays, axis, half, sag):
    """Lengths along the sheet. Its radius R has R (1 - cos(half / R)) = sag, found by halving."""
    low, high = half / 2.0, 1e9
    for _ in range(200):
        radius = 0.5 * (low + high)
        low, high = (radius, high) if radius * (1.0 - np.cos(half / radius)) > abs(sag) else (low, radius)
    sign = np.sign(sag)
    # In the plane across the cylinder: (u, w) with w towards the axis, at distance R.
    u, w, du, dw = start[axis], sign * start[2] - radius, rays[:, axis], sign * rays[:, 2]
    a, b, c = du * du + dw * dw, u * du + w * dw, u * u + w * w - radius * radius
    root = np.sqrt(b * b - a * c)
    best = np.full(len(rays), np.inf)
    for length in ((-b - root) / a, (-b + root) / a):
        low_side = w + length * dw < 0.0  # the board is the part about the bottom
        best = np.where((length > 0.0) & low_side & (length < best), length, best)
    at = start[None, :2] + best[:, None] * rays[:, :2]
    at[:, axis] = radius * np.arctan2(u + best * du, -(w + best * dw))
    return at


def _meet_bowl(start, rays, half, sag):
    """Places (n, 2): bisection between the planes that hold the bowl and a little beyond."""

    def above(length):
        a, b = ((start[i] + length * rays[:, i]) / half[i] for i in range(2))
        return start[2] + length * rays[:, 2] - sag * (1.0 - (1.0 - a * a) * (1.0 - b * b))

    planes = 1.3 * abs(sag)
    near, far = (-planes - start[2]) / rays[:, 2], (planes - start[2]) / rays[:, 2]
    missed = ~((above(near) < 0.0) & (above(far) > 0.0))
    for _ in range(60):
        middle = 0.5 * (near + far)
        before = above(middle) < 0.0
        near, far = np.where(before, middle, near), np.where(before, far, middle)
    at = start[None, :2] + near[:, None] * rays[:, :2]
    at[missed] = np.nan
    return at


def _is_on_board(target, at):
    x0, x1, y0, y1 = target.sheet.extent_mm
    return (at[:, 0] > x0) & (at[:, 0] < x1) & (at[:, 1] > y0) & (at[:, 1] < y1)


def _is_black(target, at):
    lattice = target.lattice()
    at = np.nan_to_num(at, nan=1e9)
    column, row = np.searchsorted(lattice.x_lines, at[:, 0]), np.searchsorted(lattice.y_lines, at[:, 1])
    black = np.pad(lattice.black, 1)[row, column]
    for centre in lattice.disc_centres:
        black |= np.hypot(*(at - centre).T) < lattice.disc_radius_mm
    return black

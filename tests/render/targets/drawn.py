"""A flat print drawn without the renderer: each pixel is white or black as its centre is."""

import numpy as np


def drawn(target, per_mm=1.0):
    """(height, width) 0 or 255 of the board with its margin, upright."""
    lattice, (x0, x1, y0, y1) = target.lattice(), target.sheet.extent_mm
    x, y = (low + (np.arange(round((high - low) * per_mm)) + 0.5) / per_mm for low, high in ((x0, x1), (y0, y1)))
    column, row = np.searchsorted(lattice.x_lines, x), np.searchsorted(lattice.y_lines, y)
    black = np.pad(lattice.black, 1)[row[:, None], column]
    for centre in lattice.disc_centres:
        black |= np.hypot(x - centre[0], y[:, None] - centre[1]) < lattice.disc_radius_mm
    return np.where(black, 0, 255).astype(np.uint8)


def to_pixels(target, points, per_mm=1.0):
    """(n, 2) px of nominal places in `drawn`, pixel centres at integers."""
    x0, _, y0, _ = target.sheet.extent_mm
    return (points - [x0, y0]) * per_mm - 0.5

"""A printed board as triangles: each vertex carries the place in a map of reflectance that has a texel for each cell.

All vertices of a cell take its colour from within its texel, so that edges lie exactly where the vertices are, whatever
the lines' spacing is and however the sheet is bent.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from render.targets import Target
from render.targets.lattice import Lattice

CHORD_MM = 0.002  # how far a bent sheet may lie from its triangles
DISC_CORNERS = 256  # of the polygon that stands for a disc; its area is the disc's

Faces = NDArray[np.int64]  # (m, 3) vertices, counter-clockwise seen from the board's front


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles of the board and the map of its reflectance."""

    vertices: Array  # (n, 3) mm
    normals: Array  # (n, 3) out of the front
    uv: Array  # (n, 2) places in `reflectance`: u along its columns, v along its rows, from 0 to 1
    faces: Faces
    reflectance: NDArray[np.float32]  # (rows, columns) of cells, with the margin around; a last row for the discs


@dataclass(frozen=True, slots=True)
class _Part:
    """Triangles of the flat print."""

    at: Array  # (n, 2) nominal places
    texel: Array  # (n, 2) column and row in the map, in texels
    faces: Faces


def board_mesh(target: Target) -> Mesh:
    """The printed board, front side only."""
    lattice = target.lattice()
    reflectance = _reflectance(target, lattice)
    parts = [_cells(target, lattice), *_discs(target, lattice, reflectance.shape[0])]
    at = np.concatenate([part.at for part in parts])
    offsets = np.cumsum([0] + [len(part.at) for part in parts[:-1]])
    faces = np.concatenate([part.faces + offset for part, offset in zip(parts, offsets, strict=True)])
    uv = np.concatenate([part.texel for part in parts]) / reflectance.shape[::-1]
    return Mesh(target.sheet.lift(at), target.sheet.normals(at), uv, faces, reflectance)


def _reflectance(target: Target, lattice: Lattice) -> NDArray[np.float32]:
    cells = np.pad(np.where(lattice.black, target.black, target.white), 1, constant_values=target.white)
    row = np.full((1, cells.shape[1]), target.black)  # what the triangles of discs take their colour from
    return np.concatenate([cells, row]).astype(np.float32)


def _cells(target: Target, lattice: Lattice) -> _Part:
    """Rectangles of all cells without a disc, each divided where the sheet bends."""
    x0, x1, y0, y1 = target.sheet.extent_mm
    step = _longest_side(target)
    x, column = _divided(lattice.x_lines, x0, x1, step)
    y, row = _divided(lattice.y_lines, y0, y1, step)
    grid_x, grid_y = np.meshgrid(x, y)
    across, down = np.meshgrid(np.arange(len(x) - 1), np.arange(len(y) - 1))
    shown = ~np.pad(lattice.discs, 1)[row[down], column[across]]
    across, down = across[shown], down[shown]
    corners = np.stack([(down + b) * len(x) + across + a for a, b in ((0, 0), (0, 1), (1, 1), (1, 0))], axis=1)
    # Vertices of their own for each rectangle: neighbours on a line lie in different texels.
    at = np.stack((grid_x.ravel()[corners], grid_y.ravel()[corners]), axis=-1).reshape(-1, 2)
    texel = np.repeat(np.stack((column[across], row[down]), axis=1) + 0.5, 4, axis=0)
    first = 4 * np.arange(len(across))[:, None]
    return _Part(at, texel, np.concatenate([first + [0, 1, 2], first + [0, 2, 3]]))


def _longest_side(target: Target) -> float:
    """Nominal side, mm, below which an edge of a triangle leaves the sheet by less than CHORD_MM."""
    sheet = target.sheet
    bend = float(np.max(np.abs(sheet.curvatures) + 4.0 * abs(sheet.pillow_mm) / sheet.half_sides**2))
    return np.inf if bend == 0.0 else float(np.sqrt(8.0 * CHORD_MM / bend)) / max(sheet.scale)


def _divided(lines: Array, low: float, high: float, step: float) -> tuple[Array, NDArray[np.int64]]:
    """Places from `low` to `high` at all lines and between, and of each piece the number of its cell; margin is 0."""
    ends = np.concatenate([[low], lines, [high]])
    places, cells = [np.array([low])], []
    for cell, (a, b) in enumerate(pairwise(ends)):
        if b > a:
            pieces = int(np.ceil((b - a) / step)) or 1
            places.append(a + (b - a) * np.arange(1, pieces + 1) / pieces)
            cells.append(np.full(pieces, cell))
    return np.concatenate(places), np.concatenate(cells)


def _discs(target: Target, lattice: Lattice, rows: int) -> list[_Part]:
    """For each disc its polygon, and the white of its cell around it."""
    if not lattice.disc_radius_mm:
        return []
    angle = np.arange(DISC_CORNERS) * (2.0 * np.pi / DISC_CORNERS)  # has the corners of a square cell
    ring = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    rim = ring * lattice.disc_radius_mm / np.sqrt(np.sinc(2.0 / DISC_CORNERS))
    step = _longest_side(target)
    parts: list[_Part] = []
    cells = np.argwhere(lattice.discs)
    for centre, (row, column) in zip(lattice.disc_centres, cells, strict=True):
        half = 0.5 * np.array([np.diff(lattice.x_lines)[column], np.diff(lattice.y_lines)[row]])
        border = ring / np.max(np.abs(ring), axis=1, keepdims=True) * half
        parts.append(_ring(centre + 0.0 * rim, centre + rim, step, np.array([0.5, rows - 0.5])))
        parts.append(_ring(centre + rim, centre + border, step, np.array([column + 1.5, row + 1.5])))
    return parts


def _ring(inner: Array, outer: Array, step: float, texel: Array) -> _Part:
    """Between two closed polygons (n, 2) that run from x to y."""
    pieces = int(np.ceil(np.max(np.linalg.norm(outer - inner, axis=1)) / step)) or 1
    share = np.arange(pieces + 1)[:, None, None] / pieces
    at = (inner + share * (outer - inner)).reshape(-1, 2)
    piece, side = (index.ravel() for index in np.mgrid[0:pieces, 0 : len(inner)])
    here, following = piece * len(inner) + side, piece * len(inner) + (side + 1) % len(inner)
    beyond, beyond_following = here + len(inner), following + len(inner)
    faces = [(here, beyond_following, beyond), (here, following, beyond_following)]
    return _Part(at, np.tile(texel, (len(at), 1)), np.concatenate([np.stack(face, axis=1) for face in faces]))

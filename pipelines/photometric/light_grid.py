"""The unknown light: three smooth fields over the board, each by its values at the nodes of a coarse grid.

The fields are the grey values of white, of black and of what lies behind the board, as they would be in the middle of a
large patch. White less black is the light's gain, black above its reflectance an offset, as by a gloss or by stray
light. Between nodes a field is bilinear; beyond the board it is that of the nearest border.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from render.targets import Target

FIELDS = 3  # white, black, behind
SMOOTH_GREY = 20.0  # standard deviation of neighbouring nodes' difference, grey values: what an unseen node goes by


@dataclass(frozen=True, slots=True)
class LightGrid:
    """Nodes over the board with its margin, row by row, and where n pixels lie between them."""

    columns: int  # nodes along x
    rows: int
    cells: NDArray[np.int64]  # (n,) cell of the grid that a pixel looks at, row by row
    shares: Array  # (n, 4) weights of the cell's nodes: upper left, upper right, lower left, lower right

    @staticmethod
    def over(target: Target, points: Array, spacing_mm: float) -> LightGrid:
        """points: (n, 2) or (n, 3) near the board's plane, mm. spacing_mm: of the nodes.

        The first node lies half a spacing before the board's border: with the side of a square for spacing, nodes lie
        in the middle of squares, and every edge in the middle of a cell, with its surroundings on both sides.
        """
        x0, x1, y0, y1 = target.extent_mm
        columns, rows = (2 + int(np.ceil((high - low) / spacing_mm - 1e-9)) for low, high in ((x0, x1), (y0, y1)))
        u = np.clip((points[:, 0] - x0) / spacing_mm + 0.5, 0.0, columns - 1.0)
        v = np.clip((points[:, 1] - y0) / spacing_mm + 0.5, 0.0, rows - 1.0)
        left, top = np.minimum(u.astype(np.int64), columns - 2), np.minimum(v.astype(np.int64), rows - 2)
        a, b = u - left, v - top
        shares = np.column_stack(((1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b))
        return LightGrid(columns, rows, top * (columns - 1) + left, shares)

    @property
    def cell_count(self) -> int:
        """Cells between the nodes."""
        return (self.columns - 1) * (self.rows - 1)

    @property
    def node_count(self) -> int:
        """Nodes of one field."""
        return self.columns * self.rows

    def nodes(self) -> NDArray[np.int64]:
        """(cells, 4) nodes around each cell, in the order of `shares`."""
        cell = np.arange(self.cell_count)
        first = cell + cell // (self.columns - 1)
        return np.column_stack((first, first + 1, first + self.columns, first + self.columns + 1))

    def neighbours(self) -> NDArray[np.int64]:
        """(pairs, 2) nodes beside each other along x or along y, the lower number first."""
        number = np.arange(self.node_count).reshape(self.rows, self.columns)
        along_x = np.stack((number[:, :-1].ravel(), number[:, 1:].ravel()), axis=1)
        along_y = np.stack((number[:-1].ravel(), number[1:].ravel()), axis=1)
        return np.vstack((along_x, along_y))

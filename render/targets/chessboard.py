"""The target: a chessboard with a raised circle, as values, points and outlines.

Object frame, mm: origin at the first inner corner, x along the columns, y along the rows, z into the board. The
square of column 1, row 1 is black and lies at negative x and y. The circle is a thin black disc that floats above a
white square.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from render.targets import PATTERN_MEANING
from render.targets.lattice import Lattice, chess_lattice
from render.targets.sheet import Sheet
from render.targets.typed import check_types

CIRCLE = "circle"
MAX_SQUARES, MAX_MARGIN = 24, 3.0  # the map of the light has 100 x 100 points in a square


@dataclass(frozen=True, slots=True, kw_only=True)
class Chessboard:
    """Chessboard with a raised circle, which tells the orientation where the squares look the same after half a turn.

    Raises:
        ValueError: a board that is too small, or a circle that does not fit its square or lies in the board's middle.
    """

    pattern: Annotated[Literal["chessboard"], PATTERN_MEANING] = "chessboard"
    columns: Annotated[int, "squares along x"] = 10
    rows: Annotated[int, "squares along y"] = 7
    square_mm: Annotated[float, "side of a square, mm"] = 100.0
    margin_squares: Annotated[float, "white margin around the squares, in squares"] = 1.0
    circle_square: Annotated[tuple[int, int], "column and row, from 1, of the white square under the circle"] = (1, 2)
    circle_radius_mm: Annotated[float, "radius of the circle, mm"] = 30.0
    circle_height_mm: Annotated[float, "height of the circle above the board, towards the camera, mm"] = 10.0
    white: Annotated[float, "reflectance of white squares and margin"] = 0.8
    black: Annotated[float, "reflectance of black squares"] = 0.05
    circle: Annotated[float, "reflectance of the circle"] = 0.04

    def __post_init__(self) -> None:
        check_types(self)
        self._check_squares()
        for name in ("square_mm", "circle_radius_mm", "circle_height_mm"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"target {name} is {getattr(self, name)}; it must be above 0 mm")
        if not 0.5 <= self.margin_squares <= MAX_MARGIN:
            raise ValueError(f"target margin_squares is {self.margin_squares}; it must lie in 0.5 to {MAX_MARGIN}")
        for name in ("white", "black", "circle"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"target {name} is {getattr(self, name)}; a reflectance lies in 0 to 1")
        self._check_circle()

    def _check_squares(self) -> None:
        if not (4 <= self.columns <= MAX_SQUARES and 4 <= self.rows <= MAX_SQUARES):
            given = f"target has {self.columns} x {self.rows} squares"
            raise ValueError(f"{given}; each number must lie in 4 to {MAX_SQUARES}")

    def _check_circle(self) -> None:
        column, row = self.circle_square
        if not (1 <= column <= self.columns and 1 <= row <= self.rows and (column + row) % 2 == 1):
            raise ValueError(
                f"target circle_square is {list(self.circle_square)}; it must be a white square: column 1 to "
                f"{self.columns}, row 1 to {self.rows}, with an odd sum"
            )
        if (2 * column, 2 * row) == (self.columns + 1, self.rows + 1):
            raise ValueError(
                f"target circle_square is {list(self.circle_square)}, the middle of {self.columns} x {self.rows} "
                "squares, which look the same after half a turn; choose another white square"
            )
        if self.circle_radius_mm > 0.45 * self.square_mm:
            raise ValueError(
                f"target circle_radius_mm is {self.circle_radius_mm}; at most 0.45 of a square fits, "
                f"{0.45 * self.square_mm:g} mm"
            )

    @property
    def inner(self) -> tuple[int, int]:
        """Inner corners along x and along y."""
        return self.columns - 1, self.rows - 1

    @property
    def point_grid(self) -> tuple[int, int]:
        """Columns and rows of the inner corners."""
        return self.inner

    @property
    def corners(self) -> Array:
        """(n, 3) inner corners, mm, x fastest."""
        across, down = self.inner
        y, x = np.mgrid[0:down, 0:across]
        return np.stack((x.ravel(), y.ravel(), 0.0 * x.ravel()), axis=1) * self.square_mm

    @property
    def circle_centre(self) -> Array:
        """(3,) centre of the circle, mm."""
        column, row = self.circle_square
        return np.array([(column - 1.5) * self.square_mm, (row - 1.5) * self.square_mm, -self.circle_height_mm])

    @property
    def points(self) -> Array:
        """(n + 1, 3) all points, mm: the inner corners, then the circle's centre."""
        return np.vstack((self.corners, self.circle_centre))

    @property
    def circle_index(self) -> int:
        """Row of the circle in `points`."""
        return self.inner[0] * self.inner[1]

    @property
    def board_centre(self) -> Array:
        """(3,) centre of the squares, mm."""
        return np.array([(self.columns - 2) * self.square_mm / 2.0, (self.rows - 2) * self.square_mm / 2.0, 0.0])

    @property
    def extent_mm(self) -> tuple[float, float, float, float]:
        """x_min, x_max, y_min, y_max of the board with its margin, mm."""
        margin = (1.0 + self.margin_squares) * self.square_mm
        width, height = (self.columns - 2) * self.square_mm, (self.rows - 2) * self.square_mm
        return -margin, width + margin, -margin, height + margin

    @property
    def front_mm(self) -> float:
        """Least z of the target, mm: the circle's."""
        return -self.circle_height_mm

    @property
    def sheet(self) -> Sheet:
        """The flat board with its margin."""
        return Sheet(self.extent_mm)

    def lattice(self) -> Lattice:
        """A cell for each square."""
        return chess_lattice(self.columns, self.rows, self.square_mm)

    def rim(self, point: int) -> Array | None:
        """(n, 3) outline, mm, of what the point is the centre of: the circle's rim; None for a corner."""
        return self.circle_rim() if point == self.circle_index else None

    def index(self, point: str | tuple[int, int]) -> int:
        """Row in `points` of "circle" or of an inner corner (column, row), from 0.

        Raises:
            ValueError: no such point.
        """
        across, down = self.inner
        if isinstance(point, str):
            if point == CIRCLE:
                return self.circle_index
        elif len(point) == 2 and 0 <= point[0] < across and 0 <= point[1] < down:
            return int(point[1]) * across + int(point[0])
        shown = repr(point) if isinstance(point, str) else str(list(point))
        raise ValueError(
            f'target has no point {shown}; give "circle" or an inner corner [column, row] with column 0 to '
            f"{across - 1} and row 0 to {down - 1}"
        )

    def outline(self, steps: int = 64) -> Array:
        """(n, 3) points along the board's border and the circle's rim, mm, that bound its image."""
        x0, x1, y0, y1 = self.extent_mm
        s = np.linspace(0.0, 1.0, steps)
        sides = [
            np.column_stack((x0 + (x1 - x0) * s, np.full(steps, y0))),
            np.column_stack((x0 + (x1 - x0) * s, np.full(steps, y1))),
            np.column_stack((np.full(steps, x0), y0 + (y1 - y0) * s)),
            np.column_stack((np.full(steps, x1), y0 + (y1 - y0) * s)),
        ]
        border = np.column_stack((np.vstack(sides), np.zeros(4 * steps)))
        return np.vstack((border, self.circle_rim(steps)))

    def circle_rim(self, steps: int = 256) -> Array:
        """(steps, 3) points on the circle's rim, mm."""
        angle = np.arange(steps) * (2.0 * np.pi / steps)
        rim = np.stack((np.cos(angle), np.sin(angle), 0.0 * angle), axis=1) * self.circle_radius_mm
        return rim + self.circle_centre

    def reflectance(self) -> NDArray[np.float32]:
        """Reflectance, one texel per square with the margin as one ring of texels, row 1 first."""
        squares = np.where(self.lattice().black, self.black, self.white)
        return np.pad(squares, 1, constant_values=self.white).astype(np.float32)

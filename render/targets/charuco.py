"""OpenCV's ChArUco board: a chessboard with a marker in the middle of each white square."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from render.targets import PATTERN_MEANING
from render.targets.lattice import Lattice, Rectangle, bit_rectangles, lattice_of
from render.targets.markers import DICTIONARIES, marker_bits, marker_count
from render.targets.printed import MAX_LINES
from render.targets.squares import BoardOfSquares


@dataclass(frozen=True, slots=True, kw_only=True)
class Charuco(BoardOfSquares):
    """What `cv2.aruco.CharucoBoard` draws for these numbers; the origin is the first inner corner.

    Points: inner corners row by row, numbered as OpenCV numbers them. The first square, at negative x and y, is black;
    markers are numbered in the white squares row by row.

    Raises:
        ValueError: a value out of range, an unknown dictionary or one with too few markers.
    """

    pattern: Annotated[Literal["charuco"], PATTERN_MEANING] = "charuco"
    marker_mm: Annotated[float, "side of a marker with its black border, mm"] = 75.0
    dictionary: Annotated[str, "OpenCV's dictionary of the markers without its prefix DICT_, such as 4X4_50"] = "4X4_50"

    def check_pattern(self) -> None:
        """Refuse a pattern that cannot be."""
        BoardOfSquares.check_pattern(self)  # a slotted dataclass is made anew, so that a bare super() fails
        if not 0.3 * self.square_mm <= self.marker_mm <= 0.9 * self.square_mm:
            raise ValueError(
                f"target marker_mm is {self.marker_mm}; it must lie in 0.3 to 0.9 of a square, "
                f"{0.3 * self.square_mm:g} to {0.9 * self.square_mm:g} mm"
            )
        if self.dictionary not in DICTIONARIES:
            raise ValueError(f"target dictionary is {self.dictionary!r}; choose one of {', '.join(DICTIONARIES)}")
        known = marker_count(self.dictionary)
        if self.marker_count > known:
            raise ValueError(
                f"target has {self.marker_count} markers and dictionary {self.dictionary} only {known}; choose a "
                "larger dictionary or fewer squares"
            )
        lines = max(len(self.lattice().x_lines), len(self.lattice().y_lines))
        if lines > MAX_LINES:
            raise ValueError(
                f"target has {lines} lines between modules along one side; at most {MAX_LINES} work: take fewer squares"
            )

    @property
    def marker_count(self) -> int:
        """White squares."""
        return self.columns * self.rows // 2

    def draw(self) -> Lattice:
        """Squares and the modules of the markers."""
        square, marker = self.square_mm, self.marker_mm
        places = [(column, row) for row in range(self.rows) for column in range(self.columns)]
        rectangles = [
            Rectangle((column - 1) * square, (row - 1) * square, square, square, black=(column + row) % 2 == 0)
            for column, row in places
        ]
        white = [(column, row) for column, row in places if (column + row) % 2 == 1]
        for number, (column, row) in enumerate(white):
            bits = marker_bits(self.dictionary, number)
            x, y = ((place - 0.5) * square - 0.5 * marker for place in (column, row))
            module = marker / (len(bits) + 2)
            rectangles.append(Rectangle(x, y, marker, marker))
            rectangles += bit_rectangles(bits, x + module, y + module, module)
        return lattice_of(rectangles)

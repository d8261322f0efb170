"""Kalibr's AprilGrid: tags of the family 36h11 in rows, with a small black square at each of their corners."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from eposit.arrays import Array
from render.targets import PATTERN_MEANING
from render.targets.lattice import Cells, Lattice, Rectangle, bit_rectangles, lattice_of
from render.targets.markers import TAG_FAMILY, marker_bits, marker_count
from render.targets.printed import PrintedBoard, check_counts, check_length

BORDER_MODULES = 2  # black, around the bits: Kalibr's; tags of other makers and OpenCV's default have one
LEAST_TAGS, MOST_TAGS = 1, 20


@dataclass(frozen=True, slots=True, kw_only=True)
class AprilGrid(PrintedBoard):
    """What `kalibr_create_target_pdf --type apriltag` prints for these numbers.

    Tags are numbered row by row from the lower left one, their corners in the same way: point 0 is the lower left
    corner of tag 0, the origin, point 1 its lower right corner, point 2 the lower left corner of tag 1; the upper
    corners of the lowest tags follow as the second row of points. x runs to the right and y down, so that Kalibr's own
    frame, whose y runs up, is this one turned by half a turn about x.

    Raises:
        ValueError: a value out of range.
    """

    pattern: Annotated[Literal["aprilgrid"], PATTERN_MEANING] = "aprilgrid"
    columns: Annotated[int, "tags along x, Kalibr's tagCols"] = 6
    rows: Annotated[int, "tags along y, Kalibr's tagRows"] = 6
    tag_mm: Annotated[float, "side of a tag with its black border, mm; Kalibr's tagSize"] = 88.0
    spacing: Annotated[float, "distance between tags in sides of a tag; Kalibr's tagSpacing"] = 0.3

    def check_pattern(self) -> None:
        """Refuse a pattern that cannot be."""
        check_counts("tags", self.columns, self.rows, LEAST_TAGS, MOST_TAGS)
        check_length("tag_mm", self.tag_mm)
        if not 0.05 <= self.spacing <= 1.0:
            raise ValueError(f"target spacing is {self.spacing}; it must lie in 0.05 to 1 sides of a tag")
        if self.columns * self.rows > marker_count(TAG_FAMILY):
            raise ValueError(
                f"target has {self.columns * self.rows} tags; the family 36h11 has {marker_count(TAG_FAMILY)}"
            )

    @property
    def pitch_mm(self) -> float:
        """From a tag to the next, mm."""
        return (1.0 + self.spacing) * self.tag_mm

    @property
    def unit_mm(self) -> float:
        """Side of a tag, mm."""
        return self.tag_mm

    @property
    def point_grid(self) -> tuple[int, int]:
        """Columns and rows of the tags' corners."""
        return 2 * self.columns, 2 * self.rows

    @property
    def pattern_points(self) -> Array:
        """(n, 2) corners of the tags, mm: row by row of corners from below, x fastest."""
        x, y = ((self.pitch_mm * np.arange(n)[:, None] + [0.0, self.tag_mm]).ravel() for n in (self.columns, self.rows))
        return np.stack((np.tile(x, len(y)), np.repeat(-y, len(x))), axis=1)

    def corner_index(self, tag: int, corner: int) -> int:
        """Point of a tag's corner 0 to 3: upper left, upper right, lower right, lower left on the upright board."""
        row, column = divmod(tag, self.columns)
        right, up = int(corner in (1, 2)), int(corner in (0, 1))
        return (2 * row + up) * 2 * self.columns + 2 * column + right

    @property
    def pattern_extent_mm(self) -> tuple[float, float, float, float]:
        """Of the tags and the squares at their corners, mm."""
        gap = self.spacing * self.tag_mm
        return -gap, self.columns * self.pitch_mm, -self.rows * self.pitch_mm, gap

    def draw(self) -> Lattice:
        """Tags, and squares at their corners."""
        tag, gap, pitch = self.tag_mm, self.spacing * self.tag_mm, self.pitch_mm
        rectangles = [
            Rectangle(column * pitch - gap, -row * pitch, gap, gap)
            for row in range(self.rows + 1)
            for column in range(self.columns + 1)
        ]
        for number in range(self.columns * self.rows):
            row, column = divmod(number, self.columns)
            x, y = column * pitch, -row * pitch - tag
            bits = tag_bits(number)
            module = tag / (len(bits) + 2 * BORDER_MODULES)
            rectangles.append(Rectangle(x, y, tag, tag))
            rectangles += bit_rectangles(bits, x + BORDER_MODULES * module, y + BORDER_MODULES * module, module)
        return lattice_of(rectangles)


def tag_bits(number: int) -> Cells:
    """(6, 6) bits of a tag as Kalibr prints it, row 0 at the top, True where white: OpenCV's after half a turn."""
    return marker_bits(TAG_FAMILY, number)[::-1, ::-1]

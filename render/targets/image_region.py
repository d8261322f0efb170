"""A rectangle of pixels: where in a picture a target is."""

from __future__ import annotations

from typing import NamedTuple


class Region(NamedTuple):
    """A rectangle of a picture, px, from its upper left pixel."""

    x: int
    y: int
    width: int
    height: int

    @property
    def pixels(self) -> tuple[slice, slice]:
        """Rows and columns, to index a picture (height, width) with."""
        return slice(self.y, self.y + self.height), slice(self.x, self.x + self.width)

    @classmethod
    def whole(cls, width: int, height: int) -> Region:
        """The whole of a picture."""
        return cls(0, 0, width, height)

    @classmethod
    def between(cls, low: tuple[int, int], high: tuple[int, int]) -> Region:
        """From pixel `low` to before pixel `high`, both (x, y)."""
        return cls(low[0], low[1], high[0] - low[0], high[1] - low[1])

    def grown(self, margin: int, width: int, height: int) -> Region:
        """With a margin on every side, as far as a picture of that size reaches."""
        low = max(self.x - margin, 0), max(self.y - margin, 0)
        high = min(self.x + self.width + margin, width), min(self.y + self.height + margin, height)
        return Region.between(low, high)

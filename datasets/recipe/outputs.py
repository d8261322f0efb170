"""What a dataset holds beside its grey pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

Layer = Literal["depth", "range", "normal", "object_id"]
LAYERS: tuple[Layer, ...] = ("depth", "range", "normal", "object_id")


@dataclass(frozen=True, slots=True, kw_only=True)
class Outputs:
    """Colour, and truth for every pixel.

    Raises:
        ValueError: a layer that is named twice.
    """

    colour: Annotated[bool, "whether pictures are in colour; detection then reads their grey"] = False
    aovs: Annotated[
        tuple[Layer, ...],
        "truth for every pixel, one EXR for each frame: depth along the axis and range, mm; normal in camera axes; "
        "object_id",
    ] = ()

    def __post_init__(self) -> None:
        if len(set(self.aovs)) < len(self.aovs):
            raise ValueError(f"outputs aovs is {list(self.aovs)}; name each layer once")

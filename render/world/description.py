"""The world around the target as values: what surrounds it, what it is made of, what stands in its way.

Lengths are mm in the object frame; up is the board's -y. Ranges are least and largest, drawn evenly; two equal numbers
fix a value.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Literal

Method = Literal["closed", "hybrid", "path"]
Surround = Literal["studio", "room", "sky", "envmap", "scene"]
Surface = Literal["matt", "rough_plastic", "laminated"]
Range = tuple[float, float]
Count = tuple[int, int]

FILES = {"envmap": (".exr", ".hdr"), "scene": (".xml",)}  # surrounds that take a file, and the endings of its name
SHA256 = re.compile(r"[0-9a-f]{64}")
MAX_CLUTTER, MAX_OCCLUDERS, MAX_BOARDS = 200, 8, 8


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """What surrounds the target, how light is computed, and what is drawn at random.

    Raises:
        ValueError: a value out of range, or values that contradict each other.
    """

    method: Annotated[
        Method,
        "closed: the flat matt board in the studio, exact and fastest; hybrid: light by Mitsuba, edges in closed form; "
        "path: all by Mitsuba's path tracer",
    ] = "closed"
    surround: Annotated[
        Surround,
        "studio: the recipe's light; room: a furnished room from the seed; sky: sun and sky over a wide ground; "
        "envmap: an environment map; scene: a Mitsuba scene",
    ] = "studio"
    file: Annotated[
        str, "environment map (.exr, .hdr) or Mitsuba scene (.xml), from the recipe's folder; empty for the others"
    ] = ""
    file_sha256: Annotated[
        str, "SHA-256 over the file and all that it reads; filled in where it is left out, checked where it is given"
    ] = ""
    draw: Annotated[
        Literal["dataset", "pose"], "how often what is random is drawn: once for the dataset, or anew for each pose"
    ] = "dataset"

    surface: Annotated[Surface, "of the board: matt paper, rough plastic, or paper under a thin smooth laminate"] = (
        "matt"
    )
    roughness_range: Annotated[Range, "roughness of rough plastic, 0.02 smooth to 1"] = (0.15, 0.15)
    clutter: Annotated[Count, "least and most objects around the target"] = (0, 0)
    occluders: Annotated[Count, "least and most poles and balls in front of the target"] = (0, 0)
    boards: Annotated[Count, "least and most other chessboards, of other sizes than the target"] = (0, 0)
    absent_share: Annotated[float, "share of draws without the target, as negatives for detectors, 0 to 1"] = 0.0

    floor_mm: Annotated[float, "height of the target's centre above floor or ground, mm"] = 2600.0
    room_mm: Annotated[
        tuple[float, float, float], "width, height and depth of the room, mm; the target hangs near a wall"
    ] = (9000.0, 5600.0, 8000.0)
    lamp_power_range: Annotated[Range, "power of each of the room's lamps, as a share of its usual one"] = (1.0, 1.0)
    lamp_shift_range_mm: Annotated[Range, "how far each lamp hangs from its usual place, mm"] = (0.0, 0.0)
    sun_elevation_range_deg: Annotated[Range, "height of the sun above the horizon, degrees"] = (40.0, 40.0)
    rotation_range_deg: Annotated[
        Range, "turn of sun, sky or environment map about the vertical, degrees; at 0 the sun stands behind the camera"
    ] = (30.0, 30.0)
    turbidity: Annotated[float, "haze of the sky: 1 arctic air to 10"] = 3.0
    exposure_range: Annotated[Range, "exposure as a share of the sensor's, which is metered on the board's white"] = (
        1.0, 1.0,
    )  # fmt: skip

    mm_per_unit: Annotated[float, "length of one unit of a Mitsuba scene, mm; 1000 for scenes in metres"] = 1000.0
    place: Annotated[tuple[float, float, float], "the target's centre in a Mitsuba scene, in its units"] = (
        0.0,
        0.0,
        0.0,
    )
    facing: Annotated[tuple[float, float, float], "direction out of the target's front in a Mitsuba scene"] = (
        0.0,
        0.0,
        1.0,
    )
    up: Annotated[tuple[float, float, float], "direction of the target's upper edge in a Mitsuba scene"] = (
        0.0,
        1.0,
        0.0,
    )

    path_samples: Annotated[int, "rays for a pixel around the target, by path"] = 64
    background_samples: Annotated[int, "rays for a pixel elsewhere, by path and hybrid"] = 16
    path_depth: Annotated[int, "longest path: 2 is direct light, 6 has most of a room's"] = 6
    bake_samples: Annotated[int, "rays for a texel of the baked light, by hybrid"] = 256
    layer_samples: Annotated[int, "rays for a pixel of the shiny layer, by hybrid"] = 4

    def __post_init__(self) -> None:
        self._check_method()
        self._check_file()
        for name, (least, most, unit) in _RANGES.items():
            low, high = getattr(self, name)
            if not least <= low <= high <= most:
                raise ValueError(
                    f"world {name} is {[low, high]}; give the least and the largest, in {least:g} to {most:g}{unit}"
                )
        for name, (least, most, unit) in _NUMBERS.items():
            if not least <= getattr(self, name) <= most:
                raise ValueError(f"world {name} is {getattr(self, name)}; it must lie in {least:g} to {most:g}{unit}")
        self._check_room()
        self._check_place()

    def _check_method(self) -> None:
        plain = self.surround == "studio" and self.surface == "matt" and self.is_empty
        if self.method == "closed" and not plain:
            raise ValueError(
                "world method is 'closed', which shows the matt board alone in the studio; set method to hybrid or "
                "path, or leave out surround, surface, clutter, occluders, boards and absent_share"
            )
        if self.method == "hybrid" and self.draw == "pose":
            raise ValueError(
                "world method is 'hybrid', whose light is baked once, and draw is 'pose'; set draw to dataset, or "
                "method to path"
            )
        if self.absent_share and self.draw == "dataset":
            raise ValueError(
                f"world absent_share is {self.absent_share:g} and draw is 'dataset', which leaves out the target "
                "in all frames or in none; set draw to pose"
            )

    def _check_file(self) -> None:
        endings = FILES.get(self.surround)
        if endings is None:
            if self.file or self.file_sha256:
                raise ValueError(
                    f"world file is {self.file!r} and surround {self.surround!r}, which takes none; set surround to "
                    "envmap or scene, or leave file out"
                )
        elif not self.file.lower().endswith(endings):
            raise ValueError(
                f"world file is {self.file!r}; surround {self.surround!r} takes a path that ends in "
                f"{' or '.join(endings)}"
            )
        if self.file_sha256 and not SHA256.fullmatch(self.file_sha256):
            raise ValueError(f"world file_sha256 is {self.file_sha256!r}; give 64 hexadecimal digits, or leave it out")

    def _check_room(self) -> None:
        width, height, depth = self.room_mm
        if not (1000.0 <= width <= 1e5 and 1000.0 <= height <= 1e5 and 1000.0 <= depth <= 1e5):
            raise ValueError(f"world room_mm is {list(self.room_mm)}; each must lie in 1000 to 100000 mm")
        if self.surround == "room" and self.floor_mm >= height:
            raise ValueError(
                f"world floor_mm is {self.floor_mm:g} and the room {height:g} mm high; hang the target below its "
                "ceiling"
            )

    def _check_place(self) -> None:
        (a, b, c), (x, y, z) = self.facing, self.up
        across = (b * z - c * y, c * x - a * z, a * y - b * x)
        if sum(v * v for v in across) < 1e-6 * sum(v * v for v in self.facing) * sum(v * v for v in self.up) or not any(
            across
        ):
            raise ValueError(
                f"world facing is {list(self.facing)} and up {list(self.up)}; give two directions that are not parallel"
            )

    @property
    def is_empty(self) -> bool:
        """Whether the target stands alone: no clutter, nothing in front, no other boards, never absent."""
        return not (self.clutter[1] or self.occluders[1] or self.boards[1] or self.absent_share)


_RANGES = {
    "roughness_range": (0.02, 1.0, ""),
    "clutter": (0, MAX_CLUTTER, ""),
    "occluders": (0, MAX_OCCLUDERS, ""),
    "boards": (0, MAX_BOARDS, ""),
    "lamp_power_range": (0.0, 100.0, ""),
    "lamp_shift_range_mm": (0.0, 2000.0, " mm"),
    "sun_elevation_range_deg": (2.0, 89.0, " degrees"),
    "rotation_range_deg": (-360.0, 360.0, " degrees"),
    "exposure_range": (0.01, 100.0, ""),
}
_NUMBERS = {
    "absent_share": (0.0, 1.0, ""),
    "floor_mm": (100.0, 1e5, " mm"),
    "turbidity": (1.0, 10.0, ""),
    "mm_per_unit": (1e-6, 1e9, " mm"),
    "path_samples": (1, 65536, ""),
    "background_samples": (1, 65536, ""),
    "path_depth": (2, 64, ""),
    "bake_samples": (1, 65536, ""),
    "layer_samples": (1, 65536, ""),
}

"""A frame in one drawing or several side by side, with what was found in it and enlarged residuals."""

from __future__ import annotations

import base64
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array

SMALL_PX, LARGE_PX = 320, 1000  # longest side of an image in a list of frames, and of one that stands for many
JPEG_QUALITY = 80  # a PNG of a noisy picture takes five times as much, and a dozen of them most of the page
ARROW = 0.12  # of the picture's width: what the arrow of the 95th percentile of the residuals reaches


@dataclass(frozen=True, slots=True)
class Marks:
    """Points that were found in a picture."""

    points_px: Array  # (n, 2) in the whole image, NaN where none was found
    residuals_px: Array  # (n, 2) found minus true, NaN likewise

    @property
    def told(self) -> str:
        """How many, and how far off."""
        found = int(np.sum(np.isfinite(self.points_px[:, 0])))
        lengths = np.linalg.norm(self.residuals_px, axis=1)
        lengths = lengths[np.isfinite(lengths)]
        if not found:
            return "nothing found"
        told = f"{found} of {len(self.points_px)} points"
        if not len(lengths):
            return told
        return f"{told}, RMS {np.sqrt(np.mean(lengths**2)):.2g} px, largest {lengths.max():.2g} px"


@dataclass(frozen=True, slots=True)
class Side:
    """One of the drawings of a frame: another reading of the same image, or another image of the same view."""

    name: str = ""  # empty where there is one side only
    marks: Marks | None = None
    image: NDArray[np.uint8] | None = (
        None  # (h, w) grey or (h, w, 3) RGB, the part that matters; None: that of the first side
    )
    told: str = ""  # beside what the marks tell


@dataclass(frozen=True, slots=True)
class Picture:
    """A frame that is shown, and why."""

    frame_id: int
    place: str  # of which suite, camera or system
    reason: str
    command: str  # that makes the frame again and shows it
    corner: tuple[int, int]  # x, y in the whole image of the images' first pixel, px
    sides: tuple[Side, ...]  # the first has an image, and all images have one shape

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, px."""
        image = self.sides[0].image
        if image is None:
            raise ValueError(f"frame {self.frame_id}: the first side has no image; give it one")
        return image.shape[1], image.shape[0]


@dataclass(frozen=True, slots=True)
class DrawnSide:
    """A side as the page shows it."""

    name: str
    told: str
    image: str  # a data address; empty for the first side's
    marks: str  # as the inside of an SVG element


@dataclass(frozen=True, slots=True)
class Drawn:
    """A picture as the page shows it."""

    picture: Picture
    width: int
    height: int
    sides: tuple[DrawnSide, ...]
    enlarged: float  # arrows are so many times as long as the residuals
    rod: str  # a scale for the arrows, as the inside of an SVG element; empty without arrows
    bar_px: float  # the residual that it stands for


def drawn(picture: Picture, longest_px: int = SMALL_PX) -> Drawn:
    """Draw a picture; the arrows of all sides have one scale. longest_px: of an image's sides."""
    width, height = picture.size
    marked = [side.marks for side in picture.sides if side.marks is not None]
    enlarged = _enlargement(marked, width)
    step = _round_down(ARROW * width / enlarged)
    rod = _rod(picture, step * enlarged) if marked else ""
    sides = tuple(_drawn_side(picture, side, enlarged, longest_px) for side in picture.sides)
    return Drawn(picture, width, height, sides, enlarged, rod, step)


def _drawn_side(picture: Picture, side: Side, enlarged: float, longest_px: int) -> DrawnSide:
    marks = "" if side.marks is None else _marks(picture, side.marks, enlarged)
    told = "; ".join(text for text in (side.told, "" if side.marks is None else side.marks.told) if text)
    return DrawnSide(side.name, told, "" if side.image is None else jpeg_address(side.image, longest_px), marks)


def _rod(picture: Picture, length: float) -> str:
    """A bar near the lower left corner of the drawing, light on dark."""
    width, height = picture.size
    line = f"M{0.03 * width:.1f} {0.96 * height:.1f}h{length:.1f}"
    return f'<path class="under" d="{line}"/><path class="rod" d="{line}"/>'


def jpeg_address(image: NDArray[np.uint8], longest_px: int) -> str:
    """The image (h, w) or (h, w, 3) RGB, reduced, as a JPEG in a data address."""
    scale = min(1.0, longest_px / max(image.shape))
    size = [max(1, round(scale * side)) for side in image.shape[1::-1]]
    in_order = image if image.ndim == 2 else image[..., ::-1]  # OpenCV's colours are blue, green, red
    reduced = cv2.resize(np.ascontiguousarray(in_order), size, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", reduced, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return f"data:image/jpeg;base64,{base64.b64encode(data.tobytes()).decode()}"


def _enlargement(marked: list[Marks], width: int) -> float:
    """A round number that makes most arrows visible and none of them cover the picture."""
    lengths = np.concatenate([np.zeros(0), *(np.linalg.norm(marks.residuals_px, axis=1) for marks in marked)])
    lengths = lengths[np.isfinite(lengths)]
    typical = float(np.percentile(lengths, 95.0)) if len(lengths) else 0.0
    return max(1.0, _round_down(ARROW * width / typical)) if typical > 0.0 else 1.0


def _round_down(value: float) -> float:
    """To 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step <= value / power * (1.0 + 1e-9)))


def _marks(picture: Picture, marks: Marks, enlarged: float) -> str:
    """Crosses at the points, askew since a board's edges meet there, and arrows from them along their residuals.

    Pixel i of a drawing covers [i, i + 1), pixel i of an image is centred at i.
    """
    size = 0.01 * max(picture.size)
    points = marks.points_px - picture.corner + 0.5
    tips = points + enlarged * marks.residuals_px
    crosses, arrows = [], []
    for (x, y), (u, v) in zip(points.tolist(), tips.tolist(), strict=True):
        if np.isfinite(x):
            across = f"{2.0 * size:.1f}"
            crosses.append(f"M{x - size:.1f} {y - size:.1f}l{across} {across}m-{across} 0l{across}-{across}")
        if np.isfinite(u):
            arrows.append(f"M{x:.1f} {y:.1f}L{u:.1f} {v:.1f}{_head(x, y, u, v, 1.5 * size)}")
    return f'<path class="cross" d="{"".join(crosses)}"/><path class="arrow" d="{"".join(arrows)}"/>'


def _head(x: float, y: float, u: float, v: float, most: float) -> str:
    """The two strokes of an arrow's head; none for an arrow without length."""
    length = float(np.hypot(u - x, v - y))
    if length < 1e-9:
        return ""
    size = min(most, 0.5 * length) / length
    dx, dy = size * (x - u), size * (y - v)
    return f"m{dx - dy / 2:.1f} {dy + dx / 2:.1f}L{u:.1f} {v:.1f}l{dx + dy / 2:.1f} {dy - dx / 2:.1f}"

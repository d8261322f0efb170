"""Frames to look at: what both sides found in one picture, side by side, with enlarged residuals."""

from __future__ import annotations

import base64
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array

LONGEST_PX = 320  # of a picture on the page; points and arrows are drawn over it and stay sharp
JPEG_QUALITY = 80  # a PNG of a noisy picture takes five times as much, and a dozen of them most of the page
ARROW = 0.12  # of the picture's width: what the arrow of the 95th percentile of the residuals reaches


@dataclass(frozen=True, slots=True)
class Marks:
    """Points that one side found in a picture."""

    points_px: Array  # (n, 2) in the whole image, NaN where none was found
    residuals_px: Array  # (n, 2) found minus true, NaN likewise


@dataclass(frozen=True, slots=True)
class Picture:
    """A frame that is shown, and why."""

    suite: str
    slice: str
    frame_id: int
    reason: str
    command: str  # that makes the frame again and shows it
    crop: NDArray[np.uint8]  # (h, w) grey, the part of the image that matters
    corner: tuple[int, int]  # x, y in the whole image of the crop's first pixel, px
    old: Marks
    new: Marks


@dataclass(frozen=True, slots=True)
class Drawn:
    """A picture as the page shows it."""

    picture: Picture
    width: int
    height: int
    image: str  # a data address
    enlarged: float  # arrows are so many times as long as the residuals
    rod: str  # a scale for the arrows, as the inside of an SVG element
    bar_px: float  # the residual that it stands for
    sides: tuple[tuple[str, str, str], ...]  # name, marks as the inside of an SVG element, what was found


def drawn(picture: Picture) -> Drawn:
    """Draw a picture; both sides' arrows have one scale."""
    height, width = picture.crop.shape
    enlarged = _enlargement([picture.old, picture.new], width)
    step = _round_down(ARROW * width / enlarged)
    sides = (("baseline", picture.old), ("candidate", picture.new))
    shown = tuple((name, _marks(picture, side, enlarged), _found(side)) for name, side in sides)
    return Drawn(picture, width, height, _address(picture.crop), enlarged, _rod(picture, step * enlarged), step, shown)


def _rod(picture: Picture, length: float) -> str:
    """A bar near the lower left corner of the drawing, light on dark."""
    height, width = picture.crop.shape
    line = f"M{0.03 * width:.1f} {0.96 * height:.1f}h{length:.1f}"
    return f'<path class="under" d="{line}"/><path class="rod" d="{line}"/>'


def _address(crop: NDArray[np.uint8]) -> str:
    """The picture, reduced, as a JPEG in a data address."""
    scale = min(1.0, LONGEST_PX / max(crop.shape))
    size = [max(1, round(scale * side)) for side in crop.shape[::-1]]
    reduced = cv2.resize(np.ascontiguousarray(crop), size, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", reduced, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return f"data:image/jpeg;base64,{base64.b64encode(data.tobytes()).decode()}"


def _enlargement(sides: list[Marks], width: int) -> float:
    """A round number that makes most arrows visible and none of them cover the picture."""
    lengths = np.concatenate([np.linalg.norm(side.residuals_px, axis=1) for side in sides])
    lengths = lengths[np.isfinite(lengths)]
    typical = float(np.percentile(lengths, 95.0)) if len(lengths) else 0.0
    return max(1.0, _round_down(ARROW * width / typical)) if typical > 0.0 else 1.0


def _round_down(value: float) -> float:
    """To 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step <= value / power * (1.0 + 1e-9)))


def _marks(picture: Picture, side: Marks, enlarged: float) -> str:
    """Crosses at the points, askew since a board's edges meet there, and arrows from them along their residuals.

    Pixel i of a drawing covers [i, i + 1), pixel i of an image is centred at i.
    """
    size = 0.01 * max(picture.crop.shape)
    points = side.points_px - picture.corner + 0.5
    tips = points + enlarged * side.residuals_px
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


def _found(side: Marks) -> str:
    found = int(np.sum(np.isfinite(side.points_px[:, 0])))
    lengths = np.linalg.norm(side.residuals_px, axis=1)
    lengths = lengths[np.isfinite(lengths)]
    if not found:
        return "nothing found"
    told = f"{found} of {len(side.points_px)} points"
    if not len(lengths):
        return told
    return f"{told}, RMS {np.sqrt(np.mean(lengths**2)):.2g} px, largest {lengths.max():.2g} px"

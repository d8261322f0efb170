"""Twenty places of a board before a camera, the same for every kind: lens, tilt, turn and size drawn at random."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from tests.stress.lenses import Lens

MARGIN_PX = 6.0  # between the board and the border of the picture
LENSES = {
    "pinhole": (0.95, (0.0,) * 4),
    "equidistance": (0.42, (0.0,) * 4),
    "kannala_brandt": (0.44, (-0.02, 0.004, -0.003, 0.0005)),
}  # f over the width, and coefficients


@dataclass(frozen=True)
class Framing:
    """How a kind's boards stand in the picture."""

    width: int = 800
    height: int = 600
    least: float = 0.5  # size of the board's image, of what would just fit
    most: float = 0.95
    tilt_deg: tuple[float, float] = (0.0, 50.0)
    aspect: float = 1.0  # fy over fx
    off_axis_deg: float = 35.0  # farthest that a fish-eye's board stands from the axis
    lens: str = ""  # "" takes them in turn


def lens_of(framing, view, rng):
    """The view's camera."""
    kind = framing.lens or list(LENSES)[view % len(LENSES)]
    share, k = LENSES[kind]
    f = share * framing.width * rng.uniform(0.95, 1.05)
    middle = (np.array([framing.width, framing.height]) - 1.0) / 2.0 + rng.uniform(-8.0, 8.0, 2)
    return Lens(kind, f, f * framing.aspect, *middle, k)


def place(framing, board, view):
    """Lens, rotation and translation (cam_from_obj) of one view."""
    rng = np.random.default_rng([17, view])
    lens = lens_of(framing, view, rng)
    tilt, toward, turn = rng.uniform(*np.radians(framing.tilt_deg)), *rng.uniform(-np.pi, np.pi, 2)
    fill = rng.uniform(framing.least, framing.most)
    off = np.radians(framing.off_axis_deg if lens.kind != "pinhole" else 12.0) * np.sqrt(rng.uniform())
    around = rng.uniform(-np.pi, np.pi)
    for smaller, share in itertools.product(0.9 ** np.arange(6), np.linspace(1.0, 0.0, 6)):
        R, direction = _turns(tilt, toward, turn, share * off, around)
        t = _distance(framing, board, lens, R, direction, smaller * fill)
        if t is not None:
            return lens, R, t
    raise ValueError(f"view {view}: the board does not fit into the picture")


def _turns(tilt, toward, turn, off, around):
    """Rotation of the board about its line of sight and against it, and the direction of its middle."""
    axis = np.array([-np.sin(around), np.cos(around), 0.0])
    sight = rotation(axis, off)
    own = rotation(np.array([np.cos(toward), np.sin(toward), 0.0]), tilt) @ rotation(np.array([0.0, 0.0, 1.0]), turn)
    return sight @ own, sight[:, 2]


def _distance(framing, board, lens, R, direction, fill):
    """Translation at which the board's image has the size asked for; None if it leaves the picture."""
    middle = np.array([*board.middle, 0.0])
    size = np.array([framing.width, framing.height])
    near, far = 100.0, 1e6
    for _ in range(60):
        distance = np.sqrt(near * far)
        outline = lens.project(board.outline() @ R.T + distance * direction - R @ middle)
        large = not np.all(np.isfinite(outline)) or np.any(np.ptp(outline, axis=0) > fill * size)
        near, far = (distance, far) if large else (near, distance)
    t = far * direction - R @ middle
    outline = lens.project(board.outline() @ R.T + t)
    inside = np.all(outline > MARGIN_PX - 0.5) and np.all(outline < size - 0.5 - MARGIN_PX)
    return t if inside or fill > 1.0 else None


def rotation(axis, angle):
    """(3, 3) by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross

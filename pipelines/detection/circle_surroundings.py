"""The pixels of a board that the raised circle or its shade may spoil, which no corner's fit may use."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap
from render.targets.chessboard import Chessboard

MARGIN_PX, MARGIN_BLURS = 2.5, 2.5  # kept clear around the circle: px, or blurs if they are more,
SHADOW_SQUARES = 0.1  # or its height, up to this: as far reaches the shadow of a lamp 45 degrees off the board's normal
FARTHEST_PARALLAX = 3.0  # heights of the circle: a larger one is an ambiguous map's invention
SMALL_PARALLAX = 0.3  # squares: up to here the circle may be displaced either way, which a small tilt leaves open


def ellipses_around_circle(board: BoardMap, target: Chessboard | None, blur_px: float) -> tuple[Array, Array]:
    """Ellipses of one form: at the circle's foot, and where its height may displace it.

    target: None for a board without a circle. Returns their centres (k, 2) px, k from 1 to 3 or 0 without a circle, and
    the map (2, 2) from px to the unit circle of such an ellipse.
    """
    if target is None:
        return np.empty((0, 2)), np.eye(2)
    foot, height = target.circle_centre[:2] / target.square_mm, target.circle_height_mm / target.square_mm
    base, jacobian = board(foot), board.jacobian(foot)
    inverse = np.linalg.inv(jacobian)
    parallax = board(foot, height) - base
    squares = float(np.linalg.norm(inverse @ parallax))
    ways = [0.0] if squares > FARTHEST_PARALLAX * height else [0.0, 1.0, -1.0][: 3 if squares <= SMALL_PARALLAX else 2]
    margin = max(MARGIN_PX, MARGIN_BLURS * blur_px) * np.linalg.norm(inverse, axis=1).max()
    radius = target.circle_radius_mm / target.square_mm + max(margin, min(height, SHADOW_SQUARES))
    return base + np.array(ways)[:, None] * parallax, inverse / radius

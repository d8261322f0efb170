"""The light that the raised circle keeps from the board around it, given back before corners are fitted.

The circle hides part of what lights the board evenly from all sides. Beyond the pixels that no fit uses
(`circle_surroundings`) the board is up to a tenth darker for it, on one side of the edges of the two nearest corners,
and those would move away from the circle by more than they scatter. Where it hides how much is known
(`render.targets.disc_shade`), but for the share of such light in all light: it is fitted to the circle's white square.
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap
from pipelines.detection.circle_surroundings import ellipses_around_circle
from pipelines.detection.tone_curve import Light
from render.targets.chessboard import Chessboard
from render.targets.disc_shade import blocked_share

REACH = 1.0  # squares around the circle's foot: beyond, a thousandth is hidden
CLEAR_BLURS = 2.6  # blurs between a pixel of the fit and the next black square
LEAST_PIXELS = 40
NODES = 17  # along both sides, eight to a square, between which the map from pixels to board is as good as linear
USUAL_SHARE, SHARE_SPREAD = 0.3, 0.3  # of such light in all light, before the pixels are looked at


def without_shade(light: Light, board: BoardMap, target: Chessboard, blur_px: float) -> Light:
    """The light without what the circle hides; as it is where too little of the circle's square is in the picture."""
    foot = target.circle_centre[:2] / target.square_mm
    reach = REACH * np.abs(board.jacobian(foot)).sum(axis=1)
    low = np.maximum(np.floor(board(foot) - reach), 0).astype(int)
    high = np.minimum(np.ceil(board(foot) + reach).astype(int) + 1, light.shape[::-1])
    if np.any(low >= high):
        return light
    x, y = (np.arange(low[k], high[k], dtype=np.float64) for k in range(2))
    places = _places(x, y, board) - foot[:, None, None]
    from_foot, radius = np.hypot(*places), target.circle_radius_mm / target.square_mm
    hidden = blocked_share(from_foot, radius, target.circle_height_mm / target.square_mm)
    around = slice(low[1], high[1]), slice(low[0], high[0])
    white = _on_white(places, x, y, board, target, blur_px)
    if np.sum(white) < LEAST_PIXELS:
        return light
    share = _share(light[around][white].astype(np.float64), places[:, white], hidden[white])
    out = light.copy()
    out[around] /= 1.0 - share * np.where(from_foot > radius, hidden, 0.0)
    return out


def _places(x: Array, y: Array, board: BoardMap) -> Array:
    """(2, h, w) squares that the pixels of columns x (w,) and rows y (h,) see, interpolated from a coarse grid."""
    across, to_x = _hats(x)
    down, to_y = _hats(y)
    return to_y.T @ board.meet_planes(across, down, np.zeros(1))[0] @ to_x


def _hats(line: Array) -> tuple[Array, Array]:
    """(NODES,) numbers along a line (m,), and (NODES, m) shares of them in it that interpolate linearly."""
    nodes = np.linspace(line[0], line[-1], NODES)
    return nodes, np.stack([np.interp(line, nodes, one) for one in np.eye(NODES)])


def _on_white(places: Array, x: Array, y: Array, board: BoardMap, target: Chessboard, blur_px: float) -> Mask:
    """(h, w) which pixels see the circle's white square alone, and neither circle nor what is near it.

    places: (2, h, w) squares from the circle's foot, of the pixels of columns x (w,) and rows y (h,).
    """
    centres, axes = ellipses_around_circle(board, target, blur_px)
    jacobian = board.jacobian(target.circle_centre[:2] / target.square_mm)
    margin = CLEAR_BLURS * blur_px * np.linalg.norm(np.linalg.inv(jacobian), axis=1)
    out = np.all(np.abs(places) < 0.5 - margin[:, None, None], axis=0)
    for centre in centres:
        across = axes[:, 0, None, None] * (x - centre[0]) + axes[:, 1, None, None] * (y - centre[1])[:, None]
        out &= np.sum(across**2, axis=0) > 1.0
    return out


def _share(grey: Array, places: Array, hidden: Array) -> float:
    """Share of the light from all sides in all light, by least squares with what is known of it beforehand.

    grey: (n,) light of white. places: (2, n) squares from the foot: light may have a slope. hidden: (n,).
    """
    columns = np.column_stack((np.ones(len(grey)), places.T, -hidden))
    best, *_ = np.linalg.lstsq(columns, grey, rcond=None)
    noise = np.sum((grey - columns @ best) ** 2) / (len(grey) - 4)
    weight = np.sqrt(noise) / (SHARE_SPREAD * best[0])
    known = np.vstack((columns, [(0.0, 0.0, 0.0, weight)]))
    best, *_ = np.linalg.lstsq(known, np.append(grey, weight * USUAL_SHARE * best[0]), rcond=None)
    return float(np.clip(best[3] / best[0], 0.0, 1.0))

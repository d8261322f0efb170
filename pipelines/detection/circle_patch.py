"""The pixels around the raised circle that its fit reads, and the fine grid over them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap
from pipelines.detection.circle_blur import Blur
from pipelines.detection.circle_numbers import OBLONG, SIZE, Patch, Places
from pipelines.detection.finders import Grey
from pipelines.detection.kernels import compiled
from render.targets.chessboard import Chessboard
from render.targets.disc_shade import blocked_share

FINE, COARSE = 3, 2  # cells to a pixel along each side: for small patches, for large ones
LARGE_PX = 45  # side of a patch from which the blur is well sampled by the coarse grid
CLEAR_BLURS = 3.0  # blurs between a pixel and the next black square
INK = 0.02  # squares, by which black ones may be wider in print
BAND_PX = 1.5  # pixels of the board around the circle, beyond that
LEAST_PIXELS = 40
CLIPPED = 0.5, 254.5  # grey values: a pixel that is as dark or as bright may have had less light, or more

Picture = Grey | NDArray[np.float32]  # (height, width) grey values


def _kernel(blur_px: float, finer: int) -> Array:
    """Taps of the blur on the fine grid, an even number of them where the pixel's centre lies between two cells."""
    sigma = np.sqrt(max((blur_px * finer) ** 2 - 1.0 / 12.0, 0.2))  # a fine cell is a mean already
    taps = 2 * int(np.ceil(4.0 * sigma)) + finer % 2
    bell = np.exp(-0.5 * ((np.arange(taps) - (taps - 1) / 2.0) / sigma) ** 2)
    return bell / bell.sum()


def _streak(blur: Blur, finer: int) -> tuple[Array, Places]:
    """Taps (k,) of a motion on the fine grid, and their columns and rows (k, 2).

    They stand a deviation of the gaussian apart, whose blur makes them one.
    """
    step, cells = max(1, int(blur.px * finer)), blur.streak * finer
    long = int(np.argmax(np.abs(cells)))
    half = 0.5 * abs(cells[long]) / step
    k = np.arange(-math.ceil(half), math.ceil(half) + 1)
    share = np.clip(0.5 + half - np.abs(k), 0.0, 1.0)
    aside = step * k * cells[1 - long] / cells[long]  # between two lines
    line = np.floor(aside)
    shifts = np.empty((2, len(k), 2), np.intp)
    shifts[..., long], shifts[..., 1 - long] = step * k, (line, line + 1.0)
    shares = np.stack((share * (line + 1.0 - aside), share * (aside - line))) / share.sum()
    used = shares > 0.0
    return shares[used], shifts[used]


def circle_patch(
    image: Picture, board: BoardMap, seen: tuple[Array, Array], blur: Blur, target: Chessboard, doubt: float
) -> Patch | None:
    """The pixels around the circle that see it or its white square; None if it reaches out of the image.

    seen: picture of the circle's centre (2,) px, and its change with places on the circle's plane (2, 2), px a radius.
    doubt: squares by which the circle may lie elsewhere.
    """
    at, height = target.circle_centre[:2] / target.square_mm, target.circle_height_mm / target.square_mm
    radius = target.circle_radius_mm / target.square_mm
    (centre, to_px), foot = seen, board(at)
    from_px = np.linalg.inv(to_px)
    reach = (1.0 + doubt / radius) * np.linalg.norm(to_px, axis=1) + CLEAR_BLURS * blur.reach(np.eye(2)) + BAND_PX
    low = np.floor(np.minimum(centre, foot) - reach).astype(int)
    high = np.ceil(np.maximum(centre, foot) + reach).astype(int) + 1
    if np.any(low < 0) or np.any(high > image.shape[::-1]) or np.any(high - low > min(image.shape)):
        return None
    finer = COARSE if np.max(high - low) > LARGE_PX else FINE
    fine_x, fine_y = ((np.arange((high[k] - low[k]) * finer) + 0.5) / finer - 0.5 + low[k] for k in range(2))
    planes = board.meet_planes(fine_x, fine_y, np.array([0.0, height]))
    on_board, on_disc = (planes - at[:, None, None]) / radius
    size = np.sqrt(abs(np.linalg.det(to_px)))
    blocked = blocked_share(np.hypot(*on_board), 1.0, height / radius)
    shape = (high[1] - low[1], finer, high[0] - low[0], finer)
    squares = (planes[0].reshape(2, *shape)).mean(axis=(2, 4))
    margin = INK + CLEAR_BLURS * radius * blur.reach(from_px)
    white = np.empty(squares[0].shape, bool)
    _on_white(squares[0], squares[1], margin, target.columns, target.rows, target.margin_squares, white)
    part = image[low[1] : high[1], low[0] : high[0]].astype(np.float64)
    rows, columns = map(np.ascontiguousarray, np.nonzero(white & (part > CLIPPED[0]) & (part < CLIPPED[1])))
    if len(rows) < LEAST_PIXELS:
        return None
    return Patch(
        grey=part[rows, columns],
        rows=rows,
        columns=columns,
        on_board=on_board,
        on_disc=on_disc,
        slope_x=(fine_x - centre[0])[None] / size,
        slope_y=(fine_y - centre[1])[:, None] / size,
        blocked=blocked,
        shadows=np.empty((0, *blocked.shape)),
        per_px=from_px,
        blur_px=blur.px,
        kernel=_kernel(blur.px, finer),
        streak=_streak(blur, finer) if blur.streak.any() else None,
        finer=finer,
        clipped=1.0 - len(rows) / np.count_nonzero(white),
    )


def of_one_field(patch: Patch, first: int, moved_px: Array) -> Patch:
    """The pixels of every other row, from row `first` on, 0 or 1.

    moved_px: (2,) by which the picture moved between these rows and those between them, which blurred the edges of both
    together: by half of it to either side, along one of two axes.
    """
    kept, blur = patch.rows % 2 == first, math.sqrt(max(patch.blur_px**2 - moved_px @ moved_px / 8.0, 0.0))
    own = replace(patch, grey=patch.grey[kept], rows=patch.rows[kept], columns=patch.columns[kept])
    return replace(own, blur_px=blur, kernel=_kernel(blur, patch.finer))


def around_another_disc(patch: Patch, shape: Array, height: float) -> Patch:
    """A patch with what a disc of another size and form shades: its shadow is as large as it, and as oblong.

    shape: (8,) of a fit's disc. height: above the board, radii.
    """
    along, aside = shape[OBLONG] / shape[SIZE]
    share = 1.0 / shape[SIZE]
    form = np.array([[share - along, -aside], [-aside, share + along]])
    on_board = np.einsum("ij,jhw->ihw", form, patch.on_board)
    return replace(patch, on_board=on_board, blocked=blocked_share(np.hypot(*on_board), 1.0, height))


@compiled
def _on_white(x: Array, y: Array, margin: Array, columns: int, rows: int, border: float, out: Mask) -> None:
    """Which board coordinates x, y (h, w) lie on white and `margin` (2,) squares away from black and the border."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = True
            for k in range(9):
                u, v = x[i, j] + (k % 3 - 1) * margin[0], y[i, j] + (k // 3 - 1) * margin[1]
                column, row = math.floor(u) + 1, math.floor(v) + 1
                inside = -1.0 - border < u < columns - 1 + border and -1.0 - border < v < rows - 1 + border
                black = 0 <= column < columns and 0 <= row < rows and (column + row) % 2 == 0
                if black or not inside:
                    out[i, j] = False


def prepare() -> None:
    """Call the compiled function once."""
    _on_white(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros(2), 4, 4, 1.0, np.zeros((0, 0), bool))

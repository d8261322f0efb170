"""The raised circle in an image whose board is known.

The centroid of a projected circle is not the projection of its centre. The map from board to image that the corners
give deforms the circle into an ellipse whose centre is off the image of the circle's centre by a known amount; the
ellipse is fitted to the pixels and the amount taken off.

Under the circle lies its shade. Seen at a slant, shade borders on the circle along one side and hides its edge there,
so only the open side takes part: the side towards which the circle is displaced by its height.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from eposit.arrays import Array, Mask
from pipelines.surface import BoardMap
from render.light import blocked_share
from render.target import Target

RIM_POINTS = 72
SEARCH_STEP_PX = 0.5
LEAST_STEP = 0.35  # from dark to bright across the contour, as a share of the range of grey values around it
SEARCH_SHARE = 0.25  # of the local square: how far the centre may lie from where the board predicts it
OPEN_COSINE = 0.6  # least cosine between an edge's normal and the displacement for the open side
LEAST_PARALLAX_PX = 0.3  # below which the shade under the circle is hidden on all sides
BAND_PX = 3.0  # pixels take part up to this distance outside the edge
SQUARE_MARGIN_PX = 2.2  # and if they are this far from black squares
INTERIOR = 0.5  # share of the ellipse whose pixels take part on all sides
LEAST_PIXELS = 24
LINES_PER_PX = 3  # integration lines of the blurred ellipse
TOLERANCES = (0.2, 0.1, 0.05, 0.025, 0.015, 0.015)  # scale of the robust weights, as a share of black to white
STEPS_EACH = 2
NEAREST_SHARE = 0.4  # of the board's side: nearer, no camera sees all of it; bounds how much larger the circle is
SIZE_SLACK = 0.005  # the board's map gives the size to this
START_BLUR_PX = 0.8
RESIDUAL_LIMIT = 0.06  # RMS of the fit as a share of the step from black to white


@dataclass(frozen=True, slots=True)
class Circle:
    """A circle found in an image."""

    centre_px: Array  # (2,) image of the circle's centre
    residual: float  # RMS of the fit as a share of the step from black to white


@dataclass(frozen=True, slots=True)
class _Ellipse:
    """Image of the circle relative to the image of its centre, from the board's map."""

    axes: Array  # (2, 2): unit circle to ellipse, px
    offset: Array  # (2,) centre of the ellipse minus image of the circle's centre, px
    away: Array  # (2,) unit direction in which the height displaces the circle, zero if it hardly does


def locate_circle(image: NDArray[np.uint8], board: BoardMap, target: Target) -> Array:
    """(2,) the circle's centre to about half a pixel: the strongest dark contour near where the board puts it."""
    found = _locate(image, board, target)
    return board(target.circle_centre[:2] / target.square_mm)[0] if found is None else found[1]


def find_circle(image: NDArray[np.uint8], board: BoardMap, target: Target) -> Circle | None:
    """The circle's centre, or None if no ellipse of the right shape is near where the board puts it."""
    found = _locate(image, board, target)
    if found is None:
        return None
    patch, centre, away = found
    at, radius = target.circle_centre[:2] / target.square_mm, target.circle_radius_mm / target.square_mm

    def ellipse_at(point: Array) -> _Ellipse:
        # A homothety about the camera's centre carries the raised circle onto the board: its image is that of a
        # circle on the board at the place behind it, hardly larger.
        return _ellipse(_rim(board, board.invert(point, at), radius), away)

    x0, x1, y0, y1 = target.extent_mm
    nearest = NEAREST_SHARE * max(x1 - x0, y1 - y0)
    sizes = (1.0 - SIZE_SLACK, nearest / (nearest - target.circle_height_mm) + SIZE_SLACK)
    return _fit(patch, ellipse_at, centre, sizes)


def _locate(image: NDArray[np.uint8], board: BoardMap, target: Target) -> tuple[_Patch, Array, Array] | None:
    """Pixels around the circle, its rough centre, its displacement by its height; None if it is not there."""
    at = target.circle_centre[:2] / target.square_mm
    foot, jacobian = board(at)[0], board.jacobian(at)
    parallax = board.parallax(at, target.circle_height_mm / target.square_mm)
    rim = _rim(board, at, target.circle_radius_mm / target.square_mm)
    reach = SEARCH_SHARE * np.sqrt(abs(np.linalg.det(jacobian)))
    patch = _Patch.around(image, board, target, float(np.abs(rim).max() + np.abs(parallax).max() + reach + BAND_PX + 2))
    if patch is None:
        return None
    candidates = [_search(patch, rim, foot, sign * parallax, reach) for sign in (1.0, -1.0)]
    centre, step, away = max(candidates, key=lambda candidate: candidate[1])
    if step < LEAST_STEP * float(np.ptp(patch.grey)):
        return None
    return patch, centre, away


def _rim(board: BoardMap, at: Array, radius: float) -> Array:
    """(k, 2) rim of the circle relative to the image of its centre, px."""
    angle = np.arange(RIM_POINTS) * (2.0 * np.pi / RIM_POINTS)
    rim = at + radius * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    return board(rim) - board(at)


def _ellipse(rim: Array, away: Array) -> _Ellipse:
    """The ellipse with the area moments of the rim: its centroid, and axes with A A^T four times the covariance."""
    following = np.roll(rim, -1, axis=0)
    twice_area = rim[:, 0] * following[:, 1] - rim[:, 1] * following[:, 0]  # of the triangle to the origin
    middle = rim + following
    centroid = twice_area @ middle / (3.0 * twice_area.sum())
    second = np.einsum("k,ki,kj->ij", twice_area, rim, rim) + np.einsum("k,ki,kj->ij", twice_area, following, following)
    second = (second + np.einsum("k,ki,kj->ij", twice_area, middle, middle)) / (12.0 * twice_area.sum())
    axes = 2.0 * np.linalg.cholesky(second - np.outer(centroid, centroid))
    size = np.linalg.norm(away)
    return _Ellipse(axes, centroid, away / size if size > LEAST_PARALLAX_PX else np.zeros(2))


@dataclass(frozen=True, slots=True)
class _Patch:
    """A part of the image with its pixel positions."""

    grey: Array  # (h, w)
    x: Array  # (w,) px
    y: Array  # (h,) px
    white: Mask  # (h, w) pixels that see a white square or the margin, away from black squares
    blocked: Array  # (h, w) share of the surrounding's light that the circle blocks on the board
    blocked_slope: Array  # (2, h, w) its slope along y and x, per px

    @staticmethod
    def around(image: NDArray[np.uint8], board: BoardMap, target: Target, half: float) -> _Patch | None:
        """The square of half width `half` px about the circle's foot, or None if it reaches out of the image."""
        at = target.circle_centre[:2] / target.square_mm
        centre = board(at)[0]
        low, high = np.floor(centre - half).astype(int), np.ceil(centre + half).astype(int) + 1
        if np.any(low < 0) or high[0] > image.shape[1] or high[1] > image.shape[0]:
            return None
        grey = image[low[1] : high[1], low[0] : high[0]].astype(np.float64)
        x, y = np.arange(low[0], high[0], dtype=float), np.arange(low[1], high[1], dtype=float)
        inverse = np.linalg.inv(board.jacobian(at))
        squares = (np.stack(np.meshgrid(x, y), axis=-1) - centre) @ inverse.T
        margin = SQUARE_MARGIN_PX * np.linalg.norm(inverse, axis=1)
        distance = np.linalg.norm(squares, axis=-1) * target.square_mm
        blocked = blocked_share(distance, target.circle_radius_mm, target.circle_height_mm)
        slope_y, slope_x = np.gradient(blocked)
        return _Patch(grey, x, y, _on_white(squares + at, margin, target), blocked, np.stack((slope_y, slope_x)))

    @property
    def points(self) -> Array:
        """(h, w, 2) px."""
        return np.stack(np.meshgrid(self.x, self.y), axis=-1)

    def at(self, points: Array) -> Array:
        """Nearest grey values at (..., 2) px, clamped to the patch."""
        column = np.clip(np.rint(points[..., 0] - self.x[0]).astype(int), 0, len(self.x) - 1)
        row = np.clip(np.rint(points[..., 1] - self.y[0]).astype(int), 0, len(self.y) - 1)
        return self.grey[row, column]


def _search(patch: _Patch, rim: Array, foot: Array, parallax: Array, reach: float) -> tuple[Array, float, Array]:
    """The centre on a grid whose open side has the strongest step from dark to bright; that step; the displacement."""
    count = int(np.ceil(reach / SEARCH_STEP_PX))
    shift = np.arange(-count, count + 1) * SEARCH_STEP_PX
    centres = foot + parallax + np.stack(np.meshgrid(shift, shift), axis=-1).reshape(-1, 1, 2)
    size = np.linalg.norm(parallax)
    open_side = _normals(rim) @ parallax >= OPEN_COSINE * size if size > LEAST_PARALLAX_PX else np.ones(len(rim), bool)
    edge, normals = rim[open_side], 1.5 * _normals(rim)[open_side]
    step = patch.at(centres + edge + normals) - patch.at(centres + edge - normals)
    score = np.mean(np.minimum(step, np.median(step, axis=1, keepdims=True)), axis=1)
    best = int(np.argmax(score))
    return centres[best, 0], float(score[best]), parallax


def _on_white(squares: Array, margin: Array, target: Target) -> Mask:
    """(h, w) board coordinates (h, w, 2) that are `margin` (2,) away from black squares."""
    white = np.ones(squares.shape[:2], bool)
    for side_x in (-1.0, 0.0, 1.0):
        for side_y in (-1.0, 0.0, 1.0):
            column, row = np.moveaxis(np.floor(squares + margin * (side_x, side_y)), -1, 0) + 1.0
            on_board = (column >= 0) & (column < target.columns) & (row >= 0) & (row < target.rows)
            white &= ~(on_board & ((column + row) % 2 == 0))
    return white


def _taking_part(patch: _Patch, ellipse: _Ellipse, centre: Array) -> Mask:
    """(h, w) pixels of the fit: the ellipse's interior, and the band about its open side on white."""
    inverse = np.linalg.inv(ellipse.axes)
    unit = (patch.points - centre - ellipse.offset) @ inverse.T
    radius = np.maximum(np.linalg.norm(unit, axis=-1), 1e-9)
    gradient = unit / radius[..., None] @ inverse
    slope = np.linalg.norm(gradient, axis=-1)
    distance = (radius - 1.0) / slope
    open_side = np.sum(gradient * ellipse.away, axis=-1) >= OPEN_COSINE * slope * np.linalg.norm(ellipse.away)
    return (radius < INTERIOR) | ((distance < BAND_PX) & open_side & (patch.white | (distance < -SQUARE_MARGIN_PX)))


def _fit(
    patch: _Patch, ellipse_at: Callable[[Array], _Ellipse], centre: Array, sizes: tuple[float, float]
) -> Circle | None:
    """Least squares of grey = dark + (bright, sloping) x (1 - blurred ellipse) over centre, size and blur."""
    shape = np.array([*centre, 1.0, START_BLUR_PX])
    trust, residual, contrast = np.zeros(0), np.zeros(0), 0.0
    weights: Array | None = None
    for tolerance in TOLERANCES:
        ellipse = ellipse_at(shape[:2])
        mask = _taking_part(patch, ellipse, shape[:2])
        if np.sum(mask) < LEAST_PIXELS:
            return None
        for _ in range(STEPS_EACH):
            trust = np.ones(int(np.sum(mask))) if weights is None or len(weights) != np.sum(mask) else weights
            residual, contrast = _residual(patch, mask, ellipse, shape, trust)
            if contrast <= 0.0:
                return None
            columns = [
                (_residual(patch, mask, ellipse, shape + d, trust)[0] - residual) / 1e-4 for d in np.eye(4) * 1e-4
            ]
            jacobian = np.stack(columns, axis=1)
            normal = jacobian.T @ (jacobian * trust[:, None])
            normal += 1e-3 * np.diag(np.diag(normal)) + 1e-9 * np.eye(4)
            step = -np.linalg.solve(normal, jacobian.T @ (residual * trust))
            shape = shape + np.clip(step, [-0.5, -0.5, -0.05, -0.2], [0.5, 0.5, 0.05, 0.2])
            shape[2:] = np.clip(shape[2:], [*sizes[:1], 0.2], [*sizes[1:], 6.0])
            weights = 1.0 / (1.0 + (residual / (tolerance * contrast)) ** 2) ** 2
    misfit = float(np.sqrt(np.sum(trust * residual**2) / np.sum(trust)) / max(contrast, 1.0))
    if misfit > RESIDUAL_LIMIT or np.sum(trust) < LEAST_PIXELS or not np.all(np.isfinite(shape)):
        return None
    return Circle(shape[:2], misfit)


def _residual(patch: _Patch, mask: Mask, ellipse: _Ellipse, shape: Array, trust: Array) -> tuple[Array, float]:
    """Residuals of the pixels that take part, the grey coefficients solved along, and the step in grey."""
    open_board = 1.0 - _blurred_ellipse(patch, ellipse.axes * shape[2], shape[:2] + ellipse.offset, shape[3])
    # The blur of a product with a slope: F O + blur^2 grad F . grad O.
    shade = patch.blocked * open_board + shape[3] ** 2 * np.sum(patch.blocked_slope * np.gradient(open_board), axis=0)
    design = np.stack((np.ones(int(np.sum(mask))), open_board[mask], shade[mask]), axis=1)
    root = np.sqrt(trust)
    coefficients = np.linalg.lstsq(design * root[:, None], patch.grey[mask] * root, rcond=None)[0]
    return design @ coefficients - patch.grey[mask], float(coefficients[1])


def _blurred_ellipse(patch: _Patch, axes: Array, centre: Array, blur: float) -> Array:
    """(h, w) share of each pixel that a gaussian-blurred ellipse covers.

    Each line y crosses the ellipse in one chord, whose blur along x is a difference of error functions; the lines
    are then summed with gaussian weights.
    """
    q = np.linalg.inv(axes @ axes.T)  # p^T q p = 1 on the border
    top = np.sqrt(q[0, 0] / np.linalg.det(q))
    count = max(int(np.ceil(2.0 * top * LINES_PER_PX)), 16)
    # Gauss-Chebyshev-like spacing keeps the square-root ends of the chords exact.
    angle = (np.arange(count) + 0.5) * np.pi / count
    line, weight = top * np.cos(angle), top * np.sin(angle) * np.pi / count
    middle = -q[0, 1] / q[0, 0] * line
    half = np.sqrt(np.maximum(q[0, 1] ** 2 * line**2 - q[0, 0] * (q[1, 1] * line**2 - 1.0), 0.0)) / q[0, 0]
    scale = 1.0 / (np.sqrt(2.0) * blur)
    x = (patch.x - centre[0])[None] - middle[:, None]
    along = 0.5 * (erf((x + half[:, None]) * scale) - erf((x - half[:, None]) * scale))
    across = np.exp(-((((patch.y - centre[1])[:, None] - line[None]) * scale) ** 2)) * (scale / np.sqrt(np.pi))
    return (across * weight) @ along


def _normals(rim: Array) -> Array:
    """(k, 2) outward unit normals of a closed contour."""
    tangent = np.roll(rim, -1, axis=0) - np.roll(rim, 1, axis=0)
    normal = np.stack((tangent[:, 1], -tangent[:, 0]), axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return normal * np.where(np.sum(normal * rim, axis=1, keepdims=True) < 0.0, -1.0, 1.0)

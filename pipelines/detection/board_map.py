"""The smooth map from board to image, fitted to the corners of one picture. It needs no camera and no lens."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from eposit.starts.homography import homography_start
from pipelines.detection import generic_lens

FOCAL_SHARES = (0.2, 0.3, 0.45, 0.7, 1.1, 2.0)  # focal lengths to start from, as shares of the picture's width
PINHOLE_SHARES = (0.2, 0.3, 0.45, 0.7)  # likewise of pinhole cameras
PINHOLE = 1.0 / 3.0, 2.0 / 15.0, 17.0 / 315.0  # k1, k2, k3: the series of a tangent
WIDEST_RAD = 2.2  # largest angle of a ray that a start may give a corner
START_CORNERS = 16  # that a start is worked out from
FIT_STEPS = 100
FORM_NODES = np.array([-1.0, -0.5, 0.5, 1.0])  # of the reach along a line, where its form is taken


class Hold(NamedTuple):
    """What decides how much of a lens the corners of one view tell; the rest stays near a usual lens.

    A usual lens has square pixels, its centre in the picture's, and is an equidistance lens.
    """

    deviation_px: float = 0.003  # of a corner of median weight
    aspect: float = 0.3  # spread of lenses about the usual one
    centre: float = 0.2  # likewise, shares of the picture's longer side
    bend: float = 0.4  # likewise, of each of k1, k2, k3

    def spread(self, size: tuple[int, int]) -> Array:
        """(6,) spread of a lens about the usual one, but of its focal length, which may be any. size: px."""
        centre = self.centre * max(size)
        return np.array([self.aspect, centre, centre, self.bend, self.bend, self.bend])


GOOD_CORNERS = Hold()
SEEN_CORNERS = Hold(1.0, 0.03, 0.15, 0.3)  # by a finder, some a few pixels off: they would bend a lens at will

Lift = Callable[[Array], Array]  # (m, 2) places along a bent print to (m, 3) points, both in squares


@dataclass(frozen=True, slots=True)
class BoardMap:
    """Map from board coordinates (squares, first inner corner at the origin, z into the board) to px.

    On a bent board the coordinates run along the print, which `lift` carries into space.
    """

    R: Array  # (3, 3)
    t: Array  # (3,) squares
    lens: Array  # (7,) see `generic_lens`
    lift: Lift | None = None  # of a bent board; None for a flat one

    @staticmethod
    def fit(
        at: Array,
        corners_px: Array,
        size: tuple[int, int],
        weights: Array,
        start: BoardMap | None = None,
        hold: Hold = GOOD_CORNERS,
        lift: Lift | None = None,
    ) -> BoardMap:
        """Least squares over corners (n, 2) px of points (n, 2) in squares.

        size: width and height of the picture, px. weights: (n,) relative inverse variances, 0 for a corner that takes
        no part. start: a map near by; without it, the best of focal lengths over the whole range. lift: of a bent
        board; the start's if there is a start.
        """
        begin = replace(_starts(at, corners_px, size, weights > 0.0)[0], lift=lift) if start is None else start
        return begin.fitted(at, corners_px, weights, _held(size, weights, hold))

    @staticmethod
    def fit_from_everywhere(
        at: Array,
        corners_px: Array,
        size: tuple[int, int],
        weights: Array,
        hold: Hold = GOOD_CORNERS,
        lift: Lift | None = None,
    ) -> BoardMap:
        """The best of the fits from every start; see `fit`.

        A first map whose lens is a usual one may lead into a long valley of lenses that explain the corners less well:
        where fx is twice fy, say, or in a part of a pinhole camera's picture, far from its centre.
        """
        used, held = weights > 0.0, _held(size, weights, hold)
        starts = [*_starts(at, corners_px, size, used), *_pinhole_starts(at, corners_px, size, used)]
        starts = [replace(start, lift=lift) for start in starts]
        # Twice: the first fit may stop in a narrow valley.
        fits = [start.fitted(at, corners_px, weights, held).fitted(at, corners_px, weights, held) for start in starts]
        return min(fits, key=lambda fit: float(weights[used] @ np.sum((corners_px - fit(at))[used] ** 2, axis=1)))

    def fitted(self, at: Array, corners_px: Array, weights: Array, held: Array) -> BoardMap:
        """This map after steps of least squares; see `fit` and, for `held`, `generic_lens.fit`."""
        pixels = np.where(weights[:, None] > 0.0, corners_px, 0.0)
        points = _in_space(at, 0.0, self.lift)
        found = generic_lens.fit(self.R, self.t, self.lens, points, pixels, weights, held, FIT_STEPS)
        return BoardMap(*found, self.lift)

    def __call__(self, at: Array, height: float = 0.0) -> Array:
        """(m, 2) or (2,) points in squares, `height` squares above the board, to (m, 2) or (2,) px."""
        places = np.atleast_2d(np.asarray(at, np.float64))
        pixels = np.empty(places.shape)
        x, y, z = _in_space(places, height, self.lift)
        generic_lens.project(self.R, self.t, self.lens, x, y, z, pixels)
        return pixels[0] if np.ndim(at) == 1 else pixels

    def reduced(self, by: int) -> BoardMap:
        """The map to a picture whose pixels are means of `by` x `by` pixels of this one's."""
        lens = self.lens.copy()
        lens[0] /= by
        lens[2:4] = (lens[2:4] + 0.5) / by - 0.5
        return replace(self, lens=lens)

    def jacobian(self, at: Array, height: float = 0.0, step: float = 1e-3) -> Array:
        """(m, 2, 2) or (2, 2) px per square; columns are along x and along y."""
        around = np.concatenate([np.atleast_2d(at) + sign * d for d in np.eye(2) * step for sign in (1.0, -1.0)])
        xp, xm, yp, ym = self(around, height).reshape(4, -1, 2)
        slope = np.stack((xp - xm, yp - ym), axis=-1) / (2.0 * step)
        return slope[0] if np.ndim(at) == 1 else slope

    def edge_forms(self, at: Array, jacobian: Array, reach_px: Array) -> Array:
        """(m, 2, 3) forms of the images of the lines through (m, 2) points along y and along x.

        Each is the coefficients of t^2, t^3 and t^4 of a line's distance from its tangent, px, at t px along it. The
        distance is towards the normal (c, s) at the angle that `normal_angles` gives, and t along (-s, c).

        reach_px: (m,) how far along the lines the forms are to hold.
        """
        lengths = np.linalg.norm(jacobian[:, :, ::-1], axis=1)  # of the image of a square along y, along x
        squares = reach_px[:, None] / lengths
        lines = np.eye(2)[::-1]
        away = squares[..., None, None] * FORM_NODES[:, None] * lines[:, None, :]  # (m, 2, 4, 2)
        seen = self((at[:, None, None] + away).reshape(-1, 2)).reshape(len(at), 2, 4, 2) - self(at)[:, None, None]
        angles = normal_angles(jacobian)
        normals = np.stack((np.cos(angles), np.sin(angles)), axis=-1)
        tangents = np.stack((-normals[..., 1], normals[..., 0]), axis=-1)
        share = np.einsum("mknc,mkc->mkn", seen, tangents) / reach_px[:, None, None]
        height = np.einsum("mknc,mkc->mkn", seen, normals)
        powers = share[..., None] ** np.arange(1.0, 5.0)
        return np.linalg.solve(powers, height[..., None])[..., 1:, 0] / reach_px[:, None, None] ** np.arange(2.0, 5.0)

    def slopes(self, at: Array, height: float = 0.0) -> Array:
        """(m, 2, 13) change of the pixels, `height` squares above the board, for one of each parameter."""
        out = np.empty((2 * len(at), generic_lens.PARAMETERS))
        x, y, z = _in_space(at, height, self.lift)
        generic_lens.slopes(self.R, self.t, self.lens, x, y, z, out)
        return out.reshape(-1, 2, generic_lens.PARAMETERS)

    def meet_planes(self, x_px: Array, y_px: Array, heights: Array) -> Array:
        """(k, 2, h, w) points, in squares, where the rays of a grid of pixels meet planes above the board.

        x_px: (w,) columns. y_px: (h,) rows. heights: (k,) squares above the board.
        """
        out = np.empty((len(heights), 2, len(y_px), len(x_px)))
        generic_lens.meet_planes(self.R, self.t, self.lens, x_px, y_px, -np.asarray(heights, np.float64), out)
        return out


def _in_space(at: Array, height: float, lift: Lift | None) -> Array:
    """(3, m) x, y, z of (m, 2) places in squares, `height` squares above a flat board.

    Row by row in memory: compiled functions are compiled anew for every other layout.
    """
    places = lift(at).T if lift is not None else np.vstack((at.T, np.full(len(at), -height)))
    return np.ascontiguousarray(places)


def grid(inner: tuple[int, int]) -> Array:
    """(n, 2) column and row of the inner corners, in squares."""
    y, x = np.mgrid[0 : inner[1], 0 : inner[0]]
    return np.stack((x.ravel(), y.ravel()), axis=1).astype(np.float64)


def normal_angles(jacobian: Array) -> Array:
    """(m, 2) directions, rad, of the normals of the images of lines along y and along x."""
    along_x, along_y = jacobian[:, :, 0], jacobian[:, :, 1]
    return np.stack((np.arctan2(-along_y[:, 0], along_y[:, 1]), np.arctan2(-along_x[:, 0], along_x[:, 1])), axis=1)


def _held(size: tuple[int, int], weights: Array, hold: Hold) -> Array:
    """(2, 7) a usual lens and the weights that keep a lens near it; see `generic_lens.fit`."""
    held = np.zeros((2, generic_lens.LENS))
    held[0, 2:4] = (np.array(size) - 1.0) / 2.0
    held[1, 1:] = hold.deviation_px**2 * np.median(weights[weights > 0.0]) / hold.spread(size) ** 2
    return held


def _pinhole_starts(at: Array, corners_px: Array, size: tuple[int, int], use: Mask) -> list[BoardMap]:
    """Pinhole cameras with their axis at the picture's centre, each with the pose that its homography gives."""
    centre, some = (np.array(size) - 1.0) / 2.0, _some(use)
    focal = np.array(PINHOLE_SHARES) * size[0]
    ahead = np.ones((len(focal), len(some), 1))
    bearings = np.concatenate(((corners_px[some] - centre) / focal[:, None, None], ahead), axis=2)
    bearings /= np.linalg.norm(bearings, axis=2, keepdims=True)
    R, t = homography_start(np.column_stack((at[some], np.zeros(len(some)))), bearings)
    return [BoardMap(R[i], t[i], np.array([focal[i], 0.0, *centre, *PINHOLE])) for i in range(len(focal))]


def _some(use: Mask) -> NDArray[np.intp]:
    """(m,) of the corners that take part those that a start is worked out from."""
    return np.flatnonzero(use)[:: max(1, int(np.sum(use)) // START_CORNERS)]


def _starts(at: Array, corners_px: Array, size: tuple[int, int], use: Mask) -> list[BoardMap]:
    """Equidistance lenses at the picture's centre, each with the pose that its homography gives; the best one first."""
    centre, some = (np.array(size) - 1.0) / 2.0, _some(use)
    points, offset = np.column_stack((at[some], np.zeros(len(some)))), corners_px[some] - centre
    radius = np.linalg.norm(offset, axis=1)
    shares = [share for share in FOCAL_SHARES if radius.max() / (share * size[0]) < WIDEST_RAD]
    focal = np.array(shares or [radius.max() / WIDEST_RAD / size[0]]) * size[0]
    theta = radius / focal[:, None]
    side = np.sin(theta) / np.maximum(radius, 1e-9)
    bearings = np.concatenate((offset * side[..., None], np.cos(theta)[..., None]), axis=-1)
    R, t = homography_start(points, bearings)
    maps = [BoardMap(R[i], t[i], np.array([focal[i], 0.0, *centre, 0.0, 0.0, 0.0])) for i in range(len(focal))]
    x, y, z = np.ascontiguousarray(points.T)
    found = np.empty((len(maps), len(some), 2))
    for board, pixels in zip(maps, found, strict=True):
        generic_lens.project(board.R, board.t, board.lens, x, y, z, pixels)
    order = np.argsort(np.sum((found - corners_px[some]) ** 2, axis=(1, 2)), kind="stable")
    return [maps[int(i)] for i in order]

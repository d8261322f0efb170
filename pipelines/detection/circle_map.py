"""What the board's map does not know of the circle: its place and size, its form, and its edge of higher order."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.consistency import Corners
from render.targets.chessboard import Chessboard

CORNER_PX = 0.01  # an ordinary corner's uncertainty, of which that of the map follows
# How far a lens may lie from one with square pixels, its centre in the picture's, and equidistance, if nothing is known
# of it; see `generic_lens`. Where the map's lies farther from it, the true one may, too: so many times as far.
LENS_SPREAD, FARTHER = np.array([0.02, 100.0, 100.0, 0.3, 0.3, 0.3]), 3.0
STEP = 1e-3 * np.eye(2)  # squares: for slopes along the board
LEAST_PX = 1e-4  # a corner's uncertainty, below what any picture tells
RIM_STEPS = 8  # places on the circle's edge: they tell its first harmonic from those of map errors up to the sixth


class MapErrors(NamedTuple):
    """Of the circle as the map has it, beyond its place and size."""

    form: Array  # (2,) deviations of its form, as shares; see `circle_numbers`
    shift: Array  # (2, 2) covariance, radii^2, of its edge as a whole about its centre


def prediction_covariance(board: BoardMap, target: Chessboard, shape: tuple[int, int]) -> Array:
    """(3, 3) covariance of how far the circle's height displaces it, squares, and of its size there, as a share.

    It is what one view of the corners tells. Whether a lens is longer along x than along y looks much like a tilt.
    shape: height and width of the picture, px.
    """
    at, height = target.circle_centre[None, :2] / target.square_mm, target.circle_height_mm / target.square_mm
    slopes = board.slopes(grid(target.inner)).reshape(2 * target.circle_index, -1) / CORNER_PX
    displaced = (board.slopes(at, height) - board.slopes(at))[0]
    along_x, along_y = ((board.slopes(at + step, height) - board.slopes(at - step, height))[0] for step in STEP)
    larger = np.einsum("ij,jik->k", np.linalg.inv(board.jacobian(at[0], height)), np.stack((along_x, along_y), axis=1))
    change = np.vstack((np.linalg.inv(board.jacobian(at[0])) @ displaced, larger / (4.0 * STEP[0, 0])))
    return _carried(change, slopes, board.lens, shape)


def map_errors(corners: Corners, at: Array, target: Chessboard, shape: tuple[int, int]) -> MapErrors:
    """What the corners' own errors leave open. at: (n, 2) squares. shape: height and width of the picture, px.

    With few corners the map's bend across the circle is not known: its edge lies elsewhere, but not its centre.
    """
    board, good = corners.board, corners.consistent
    covariance = corners.covariance_px2[good] + LEAST_PX**2 * np.eye(2)
    whitener = np.linalg.cholesky(np.linalg.inv(covariance)).transpose(0, 2, 1)
    slopes = (whitener @ board.slopes(at[good])).reshape(2 * int(np.sum(good)), -1)
    centre, height = target.circle_centre[:2] / target.square_mm, target.circle_height_mm / target.square_mm
    radius, turns = target.circle_radius_mm / target.square_mm, np.arange(RIM_STEPS) * (2.0 * np.pi / RIM_STEPS)
    out = np.stack((np.cos(turns), np.sin(turns)), axis=1)
    moved = board.slopes(centre + radius * out, height) - board.slopes(centre[None], height)
    moved = np.linalg.inv(board.jacobian(centre, height)) @ moved / radius
    outwards = np.einsum("kc,kcp->kp", out, moved)
    waves = np.stack((np.cos(turns), np.sin(turns), np.cos(2.0 * turns), np.sin(2.0 * turns)))
    carried = _carried(2.0 / RIM_STEPS * waves @ outwards, slopes, board.lens, shape)
    return MapErrors(np.sqrt(np.diagonal(carried)[2:]), carried[:2, :2])


def _carried(change: Array, slopes: Array, lens: Array, shape: tuple[int, int]) -> Array:
    """(k, k) covariance of k numbers that follow from a map.

    change: (k, 13) of the numbers, for one of each parameter of the map. slopes: (m, 13) likewise of coordinates of
    corners, in standard deviations. lens: (7,) of the map. shape: height and width of the picture, px.
    """
    usual = np.array([0.0, (shape[1] - 1) / 2.0, (shape[0] - 1) / 2.0, 0.0, 0.0, 0.0])
    spread = np.maximum(LENS_SPREAD, FARTHER * np.abs(lens[1:] - usual))
    rows = np.vstack((slopes, np.diag(np.append(np.zeros(7), 1.0 / spread))))
    size = np.maximum(np.linalg.norm(rows, axis=0), 1e-12)
    _, told, axes = np.linalg.svd(rows / size, full_matrices=False)
    along = change / size @ axes.T / np.maximum(told, 1e-13 * told[0])
    return along @ along.T

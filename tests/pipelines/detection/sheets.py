"""Corners of boards, flat, bent or misprinted, drawn with the errors that are stated for them, and their board fit."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import eposit
from pipelines.detection.board_fit import fit_board
from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.consistency import Corners
from pipelines.detection.corner_scatter import scatter_of_neighbours

SIZE = (1600, 1200)
SQUARE_MM, STATED_PX = 100.0, 0.002


class Sheet(NamedTuple):
    """A board. Lengths are in mm."""

    inner: tuple[int, int] = (9, 6)
    sag: float = 0.0  # of its middle, bent about y
    twist: float = 0.0  # of a corner out of its plane
    stretch: float = 1.0  # of the print along x
    displaced: float = 0.0  # deviation of each corner's print

    def points(self, rng):
        """(n, 3) as designed, along the sheet, and as printed."""
        x, y = ((grid(self.inner) - (np.array(self.inner) - 1.0) / 2.0) * SQUARE_MM).T
        wide, high = (np.array(self.inner) + 1.0) / 2.0 * SQUARE_MM
        z = -self.sag * (1.0 - (x / wide) ** 2) + self.twist * x * y / (wide * high)
        designed = np.column_stack((x * self.stretch, y, z))
        printed = designed.copy()
        printed[:, :2] += self.displaced * rng.standard_normal((len(x), 2))
        return designed, printed


class Fitted(NamedTuple):
    """Of every board."""

    alone: list  # (n, 2) errors of corners from their own pixels, px
    errors: list  # (n, 2) errors of the fit, px
    factors: list  # (n, 2, k) stated of it, px
    poses: list  # cam_from_obj
    camera: eposit.Camera

    def gain(self):
        """RMS over that of corners alone."""
        return rms(self.errors) / rms(self.alone)

    def normalised(self):
        """RMS of the errors in deviations that are stated for each point."""
        squares = [
            np.einsum("na,nab,nb->n", error, np.linalg.inv(factor @ factor.transpose(0, 2, 1)), error) / 2.0
            for error, factor in zip(self.errors, self.factors, strict=True)
        ]
        return np.sqrt(np.mean(squares))


def rms(arrays):
    return np.sqrt(np.mean(np.concatenate(arrays) ** 2))


FLAT = Sheet()


def fitted(lens="equidistance", sheet=FLAT, seed=0, boards=8):
    """Boards anywhere up to 40 degrees from the axis; corners with uneven, tilted ellipses of errors."""
    camera = eposit.Camera(lens=lens, fx=552.39, fy=552.69, cx=782.41, cy=613.71, width=SIZE[0], height=SIZE[1])
    rng, at, found = np.random.default_rng(seed), grid(sheet.inner), Fitted([], [], [], [], camera)
    while len(found.errors) < boards:
        R = Rotation.from_euler("xyz", rng.uniform(-35.0, 35.0, 3), degrees=True).as_matrix()
        away, around = np.deg2rad(rng.uniform(0.0, 40.0)), rng.uniform(0.0, 2.0 * np.pi)
        side = np.sin(away)
        t = rng.uniform(1200.0, 2500.0) * np.array([side * np.cos(around), side * np.sin(around), np.cos(away)])
        designed, printed = (camera.project(points @ R.T + t) for points in sheet.points(rng))
        if not np.all((printed > 5.0) & (printed < np.array(SIZE) - 5.0)):
            continue
        spread = STATED_PX * (np.eye(2) + 0.3 * rng.standard_normal((len(at), 2, 2)))
        pixels = printed + (spread @ rng.standard_normal((len(at), 2, 1)))[..., 0]
        fit = fit_board(measured(at, pixels, spread @ spread.transpose(0, 2, 1)), at)
        found.alone.append(pixels - designed)
        found.errors.append(fit.points_px - designed)
        found.factors.append(fit.factor)
        found.poses.append(eposit.Pose(R, t))
    return found


def measured(at, pixels, covariance):
    """Corners as `refine_corners` returns them."""
    board = BoardMap.fit(at, pixels, SIZE, np.ones(len(at)))
    scatter = scatter_of_neighbours(at, pixels - board(at), covariance, board.slopes(at))
    return Corners(pixels, covariance * scatter, np.ones(len(at), bool), 0.7, 100.0, board, scatter=scatter)

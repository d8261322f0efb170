"""What the forms of edges, as a map of few corners has them, add to the uncertainty of corners.

A corner's fit is given how its two edges bend. On a board of many corners the map knows that far better than a corner's
own pixels would; on one of nine, it has 18 coordinates for its 13 numbers, and its outermost edges are hardly told.
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.detection.board_map import Hold
from pipelines.detection.consistency import Corners

FORM_SHARE = 0.4  # of the error of an edge's form, a square's length along it, by which it moves a corner


def form_errors(corners: Corners, at: Array, reach: float, size: tuple[int, int]) -> Array:
    """(n, 2, 2) covariances, px^2, of what the map's uncertain edges move the corners by.

    The map is taken to be uncertain as its fit to the consistent corners has it. at: (n, 2) squares. reach: squares
    along the edges that the corners' fits use. size: width and height of the picture, px.
    """
    board, good = corners.board, corners.consistent
    whitener = np.linalg.cholesky(np.linalg.inv(corners.covariance_px2[good])).transpose(0, 2, 1)
    rows = (whitener @ board.slopes(at[good])).reshape(2 * int(np.sum(good)), -1)
    spread = Hold().spread(size)
    held = np.eye(rows.shape[1])[-len(spread) :] / spread[:, None]
    parameters = np.linalg.pinv(np.vstack((rows, held)))  # (p, m); times its transpose: the map's covariance
    added, jacobian = np.zeros((len(at), 2, 2)), board.jacobian(at)
    for k in range(2):
        step = np.eye(2)[k]
        sagitta = 0.5 * (board.slopes(at + step) + board.slopes(at - step)) - board.slopes(at)
        along = jacobian[:, :, k] / np.linalg.norm(jacobian[:, :, k], axis=1)[:, None]
        normal = np.stack((-along[:, 1], along[:, 0]), axis=1)
        height = np.einsum("nc,ncp->np", normal, sagitta) @ parameters
        moved = (FORM_SHARE * reach**2) ** 2 * np.sum(height**2, axis=1)
        added += moved[:, None, None] * normal[:, :, None] * normal[:, None, :]
    return added

"""One answer against the truth, as numbers that can be added up over views."""

from __future__ import annotations

import collections

import numpy as np

from tests.stress.answers import OURS

OK = "ok"
AMBIGUOUS = "orientation_ambiguous"
WRONG_SHARE = 0.3  # of the local square: a point that lies further off has another point's name
LATE = "too_late"


def measured(kind, detector, shot, answer, seconds):
    """A dictionary of one view."""
    statuses = collections.Counter([LATE] if answer is None else map(str, answer.status))
    row = {"seconds": seconds, "status": dict(statuses)}
    if answer is None:
        return row | {"seen": int(shot.seen[:-1].sum()), "found": 0, "wrong": 0}
    if kind.nothing or not len(shot.truth):
        return row | {"seen": 0, "found": 0, "wrong": int(np.sum(answer.status == OK))}
    count = len(shot.truth) - 1
    told = np.isin(answer.status, [OK, AMBIGUOUS] if kind.any_turn else [OK]) & np.isfinite(answer.points[:, 0])
    order = _best_order(kind, detector, answer, told, shot.truth)
    points, told_corners = answer.points[:count][order], told[:count][order]
    covariance = None if answer.covariance is None else answer.covariance[:count][order]
    side = _sides(shot.truth[:count], kind.board.inner)
    corners = _against(points, told_corners, covariance, shot, slice(0, count), side)
    if detector == OURS and kind.board.disc:
        corners["disc"] = _against(
            answer.points[count:], told[count:], answer.covariance[count:], shot, slice(count, count + 1), side[:1]
        )
    return row | corners


def _against(points, told, covariance, shot, part, side):
    """Counts and sums over some points."""
    error = points - shot.truth[part]
    far = np.linalg.norm(error, axis=1) > WRONG_SHARE * side
    wrong = told & (far | shot.hidden[part])
    used = told & ~wrong
    sums = {"seen": int(shot.seen[part].sum()), "found": int(np.sum(used & shot.seen[part])), "wrong": int(wrong.sum())}
    sums |= {
        "used": int(used.sum()),
        "square": float(np.sum(error[used] ** 2)),
        "sum": error[used].sum(axis=0).tolist(),
    }
    if covariance is not None and np.any(used):
        inverse = np.linalg.inv(covariance[used])
        sums["normalised"] = float(np.einsum("ni,nij,nj->", error[used], inverse, error[used]))
    sums["largest"] = float(np.max(np.linalg.norm(error[used], axis=1), initial=0.0))
    return sums


def _best_order(kind, detector, answer, told, truth):
    """Rows of the answer in the truth's order: OpenCV's boards in that of all turns that fits best."""
    across, down = kind.board.inner
    count = across * down
    if len(answer.points) < count:
        return np.arange(count)
    grid = np.arange(count).reshape(down, across)
    turns = [grid]
    if detector != OURS:
        turns = [grid, grid[::-1], grid[:, ::-1], grid[::-1, ::-1]]
        turns += [turn.T for turn in turns] if across == down else []
    elif kind.any_turn:
        turns = [grid, grid[::-1, ::-1]]

    def miss(turn):
        error = answer.points[turn.ravel()] - truth[:count]
        return np.sum(np.minimum(np.nan_to_num(np.sum(error**2, axis=1), nan=0.0), 1e6))

    return min(turns, key=miss).ravel()


def _sides(truth, inner):
    """(n,) distance to the nearest neighbour, px."""
    grid = truth.reshape(inner[1], inner[0], 2)
    sides = np.full(grid.shape[:2], np.inf)
    for axis in (0, 1):
        step = np.linalg.norm(np.diff(grid, axis=axis), axis=2)
        before, after = [slice(None)] * 2, [slice(None)] * 2
        before[axis], after[axis] = slice(0, -1), slice(1, None)
        for part in (tuple(before), tuple(after)):
            sides[part] = np.fmin(sides[part], step)
    return sides.ravel()

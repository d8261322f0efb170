"""The grid among discs in a picture: their lattice is grown from one of them, and laid onto the target's.

Where a disc's neighbours are follows from those that are known (`pipelines.detection.grid_steps`), so that a tilt or a
bent lens takes nothing away. A lattice's two shortest steps need not be the grid's own where it is tilted: the grid is
laid onto the lattice with all small whole numbers of steps.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from eposit.arrays import Array, Mask
from pipelines.detection.grid_steps import axes, predicted
from pipelines.detection.lattice_grid import Grid
from render.targets.circle_grid import CircleGrid

SEEDS = 16  # discs from which a lattice is tried, from the middle to the border
AROUND = 16  # discs around a seed among which its neighbours are
OPPOSITE = 0.3  # of a step: by how much the one to the other side may differ
LEAST_SINE = 0.5  # between the two steps of a lattice; between the shortest two it is at least 0.86
FARTHEST = 0.3  # of the shorter side: how far a disc may lie from where its neighbours put it
MOST_ROUNDS = 150
MOST_KNOWN = 2  # discs of a lattice for each of the grid's; one with more is no grid but a texture
MOST_STEPS = 2  # of a lattice to one of the grid, along each of the two
TURNS = tuple(
    np.array(((a, b), (c, d)))
    for a, b, c, d in product(range(-MOST_STEPS, MOST_STEPS + 1), repeat=4)
    if a * d - b * c == 1
)


def find_grid(points: Array, target: CircleGrid) -> list[Array]:
    """The ways (columns * rows, 2) px in which the discs may be the target's, in its order; none if they are not.

    points: (n, 2) px. There are several ways where the grid looks the same after a turn.
    """
    count, tree = target.columns * target.rows, cKDTree(points)
    outward = np.argsort(np.linalg.norm(points - points.mean(axis=0), axis=1), kind="stable")
    for seed in outward[:: max(1, len(points) // SEEDS)]:
        grid = _seeded(points, tree, int(seed))
        if grid is None:
            continue
        grid = _grown(points, tree, grid, MOST_KNOWN * count)
        if count <= np.sum(grid.known) <= MOST_KNOWN * count:
            ways = _laid(grid, target)
            if ways:
                return ways
    return []


def _seeded(points: Array, tree: cKDTree, seed: int) -> Grid | None:
    """A disc and those at its two shortest steps to both sides."""
    others = np.asarray(tree.query(points[seed], min(AROUND + 1, len(points)))[1])[1:]
    steps = points[others] - points[seed]  # the shortest first
    back = np.linalg.norm(steps[:, None] + steps, axis=-1)
    opposite = np.argmin(back, axis=1)
    good = np.flatnonzero(back[np.arange(len(steps)), opposite] < OPPOSITE * np.linalg.norm(steps, axis=1))
    for k in good[1:]:
        first, second = steps[good[0]], steps[k]
        cross = first[0] * second[1] - first[1] * second[0]
        if abs(cross) > LEAST_SINE * np.linalg.norm(first) * np.linalg.norm(second):
            along, down = (good[0], k) if cross > 0.0 else (good[0], opposite[k])
            cells = np.full((3, 3, 2), np.nan)
            cells[1, 1] = points[seed]
            cells[1, 2], cells[1, 0] = points[others[along]], points[others[opposite[along]]]
            cells[2, 1], cells[0, 1] = points[others[down]], points[others[opposite[down]]]
            return Grid(cells, white_first=False)
    return None


def _grown(points: Array, tree: cKDTree, grid: Grid, most: int) -> Grid:
    """The lattice with the discs that can be reached from it step by step, until they are more than `most`."""
    taken = np.zeros(len(points) + 1, bool)
    taken[np.asarray(tree.query(grid.points[grid.known])[1])] = True
    for _ in range(MOST_ROUNDS):
        wide = grid.padded(1)
        expected, (along, down) = predicted(wide.points), axes(wide.points)
        side = np.minimum(np.linalg.norm(along, axis=-1), np.linalg.norm(down, axis=-1))
        open_ = ~wide.known & np.isfinite(expected[..., 0]) & np.isfinite(side)
        found = _claimed(points, tree, expected[open_], FARTHEST * side[open_], taken)
        if not np.any(np.isfinite(found[:, 0])):
            break
        cells = wide.points.copy()
        cells[open_] = found
        grid = Grid(cells, white_first=False).cropped()
        if np.sum(grid.known) > most:
            break
    return grid


def _claimed(points: Array, tree: cKDTree, expected: Array, within: Array, taken: Mask) -> Array:
    """(k, 2) px of the free disc near each place, which is then taken; NaN where there is none."""
    found = np.full(expected.shape, np.nan)
    if not len(expected):
        return found
    distance, nearest = (np.asarray(part) for part in tree.query(expected))
    for k in np.argsort(distance / within, kind="stable"):  # of two places that claim a disc the nearer has it
        if distance[k] < within[k] and not taken[nearest[k]]:
            taken[nearest[k]] = True
            found[k] = points[nearest[k]]
    return found


def _laid(grid: Grid, target: CircleGrid) -> list[Array]:
    """All ways in which the target's discs lie on discs of the lattice; none if different discs may be the target."""
    cells, known = _cells(target), grid.known
    ways: list[Array] = []
    first: set[tuple[float, ...]] = set()
    for turn in TURNS:
        own = cells @ turn.T
        own -= own.min(axis=0)
        for x, y in _shifts(known, own):
            way = grid.points[own[:, 1] + y, own[:, 0] + x]
            discs = set(map(tuple, way.tolist()))
            first = first or discs
            if discs != first:
                return []
            ways.append(way)
    return ways


def _shifts(known: Mask, own: NDArray[np.int64]) -> list[tuple[int, int]]:
    """By how many columns and rows cells (n, 2) can be shifted so that each is known."""
    (rows, columns), (across, down) = known.shape, own.max(axis=0)
    if columns <= across or rows <= down:
        return []
    fits = np.ones((rows - down, columns - across), bool)
    for column, row in own.tolist():
        fits &= known[row : row + fits.shape[0], column : column + fits.shape[1]]
        if not fits.any():
            return []
    return [(int(x), int(y)) for x, y in np.argwhere(fits.T)]


def _cells(target: CircleGrid) -> NDArray[np.int64]:
    """(n, 2) the target's discs in steps of its lattice, which turn from the first to the second as x to y does.

    Steps of the asymmetric grid run along its diagonals: to (1, 1) and to (-1, 1) spacings.
    """
    x, y = np.rint(target.pattern_points / target.spacing_mm).astype(np.int64).T
    return np.stack(((x + y) // 2, (y - x) // 2) if target.asymmetric else (x, y), axis=1)

"""The chessboard in an image, whole or in part: its lattice is grown from saddles, and told apart from others.

The work is bounded whatever the picture holds: a level has at most so many pixels and so many saddles, and a lattice
at most so many rounds of growth. Levels, from the one that is looked at first: the picture reduced by powers of two,
for large squares and blurred pictures; as it is; its textured region enlarged, for squares of a few pixels.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.board_map import SEEN_CORNERS, BoardMap
from pipelines.detection.border_lines import MOST, Line, corner_places
from pipelines.detection.generic_lens import PARAMETERS
from pipelines.detection.grid_steps import axes
from pipelines.detection.identity import AnyChessboard, Placement, identify
from pipelines.detection.lattice_grid import Grid, grid_of
from pipelines.detection.lattice_growth import contrast_of, grow, look_at, looks, median_of_known, side_of, verified
from pipelines.detection.levels import LevelOf, levels
from pipelines.detection.saddle_links import link
from pipelines.detection.saddles import find_saddles, smooth
from pipelines.detection.sampling import Level
from pipelines.detection.square_look import look_at_squares
from pipelines.detection.statuses import PointStatus
from pipelines.detection.time_limit import Check, unlimited
from render.targets.chessboard import Chessboard

MOST_PIECES = 3  # of a level's lattices that are looked at, the largest
LEAST_POINTS = 7  # of a lattice: fewer make no map
LEAST_PART = 0.25  # of the board's corners; fewer are no board, unless all that is seen says which they are
LEAST_TYPICAL = 0.8  # median likeness of a board's points; noise that happens to look like a lattice has less
FARTHEST_OFF = 0.15  # sides from the map through all points: a point farther off is none of the board's
MOST_ROUGH = 0.08  # sides: root mean square distance of a board's points from the map through them; noise has more
FIRM = 0.85  # of the lattice's median likeness: a point that looks less like a corner does not tell the lattice's size
FIRM_CONTRAST = 0.25  # of its median contrast, likewise
ENOUGH_PX = 16.0  # px of a level to a square: more show no more corners
TOLD = (PointStatus.OK, PointStatus.MIRRORED)  # what is said where the picture tells which corner is which
CHANCE_SHARE = 0.6  # of an outermost line's places: fewer points beside a full line may be of other things' edges
CHANCE_LIKENESS = 0.95  # of the median likeness: they are, if they look less like corners
MOST_END_LINES = 10  # of a lattice, in excess of the board's: more are a texture's
FARTHEST_GAP = 8  # columns and rows over which a lattice is looked for beyond what hides it


@dataclass(frozen=True, slots=True)
class SeenLattice:
    """What one level shows of the board."""

    status: PointStatus  # ok if it is known which corner is which
    ids: NDArray[np.int64]  # (k,) rows in the target's corners; empty unless ok
    points_px: Array  # (k, 2) px of the picture
    count: int  # of the lattice's points
    side_px: float  # of its squares, px of the picture
    exchanged: bool = False  # whether black is white in the picture, and white black

    def is_better_than(self, other: SeenLattice | None) -> bool:
        """Whether it tells more."""
        if other is None:
            return True
        return (self.status in TOLD, self.count) > (other.status in TOLD, other.count)

    def is_sharp_at(self, scale: float) -> bool:
        """Whether the squares are so large that a level of that scale, if finer, shows no more of them."""
        return self.status in TOLD and self.side_px > ENOUGH_PX * 2.0 * scale


def find_lattice(image: NDArray[np.uint8], target: AnyChessboard, check_time: Check = unlimited) -> SeenLattice | None:
    """The board's corners as the level shows them that shows most; None if no level shows a lattice."""
    best: SeenLattice | None = None
    whole = target.inner[0] * target.inner[1]
    for level in levels(image):
        if best is not None and best.is_sharp_at(level.scale):
            continue
        check_time()
        for seen in _seen(level, target):
            check_time()
            if seen.is_better_than(best):
                best = seen
        if best is not None and best.status == PointStatus.OK and best.count == whole:
            break
    return best


def _seen(level: LevelOf, target: AnyChessboard) -> Iterator[SeenLattice]:
    """What is known of the level's largest lattices."""
    smoothed = smooth(level.grey)
    most = max(target.inner) + 2
    for piece in link(smoothed, find_saddles(smoothed))[:MOST_PIECES]:
        grid = verified(smoothed, grid_of(piece))
        if np.sum(grid.known) < LEAST_POINTS:
            continue
        if not _is_whole(grid, target):
            grid = grow(smoothed, grid, most)
        seen = _told(level, smoothed, grid, target)
        if seen is not None:
            yield seen


def _is_whole(grid: Grid, target: AnyChessboard) -> bool:
    """Whether just as many points as the board has corners are known, in as many columns and rows."""
    return bool(np.all(grid.known)) and sorted(grid.points.shape[:2]) == sorted(target.inner)


def _told(level: LevelOf, smoothed: Level, grid: Grid, target: AnyChessboard) -> SeenLattice | None:
    """Which corners the lattice's points are; None if they are too few."""
    firm = _firm_part(smoothed, grid)
    if not _is_whole(firm, target):
        firm = _firm_part(smoothed, _bridged(level, smoothed, firm, target))
    if _is_too_large(firm, target):
        firm = _without_chance_lines(level, smoothed, firm, target)
    count = int(np.sum(firm.known))
    if count < LEAST_POINTS:
        return None
    side = side_of(*(steps[firm.known] for steps in axes(firm.points)))
    firm, board = _without_outliers(firm, level, side)
    if board is None or not _is_smooth(firm, board, side):
        return None
    told = _placed(level, firm, board, target)
    if isinstance(told, PointStatus):
        enough = count >= LEAST_PART * target.inner[0] * target.inner[1]
        return SeenLattice(told, np.empty(0, np.int64), np.empty((0, 2)), count, level.scale * side) if enough else None
    corners = _on_board(smoothed, firm, board, told, target)
    ids = np.flatnonzero(corners.known)
    points = level.in_picture(corners.points.reshape(-1, 2)[ids])
    return SeenLattice(PointStatus.OK, ids, points, len(ids), level.scale * side, told.exchanged)


def _placed(level: LevelOf, grid: Grid, board: BoardMap, target: AnyChessboard) -> Placement | PointStatus:
    """Where on the board the lattice lies. One that is larger is not looked at: its squares may be thousands."""
    if _is_too_large(grid, target):
        return PointStatus.OTHER_BOARD
    rows, columns = grid.points.shape[:2]
    radius = target.circle_radius_mm / target.square_mm if isinstance(target, Chessboard) else None
    margin = target.margin_squares if isinstance(target, Chessboard) else target.margin_mm / target.square_mm
    look = look_at_squares(level.grey, board, grid, radius, margin)
    middle = (np.array([columns, rows]) - 1.0) / 2.0
    return identify((columns, rows), grid.white_first, look, target, board.jacobian(middle))


def _is_too_large(grid: Grid, target: AnyChessboard) -> bool:
    """Whether the lattice has more columns or rows than the board."""
    return any(own > most for own, most in zip(sorted(grid.points.shape[:2]), sorted(target.inner), strict=True))


def _without_chance_lines(level: LevelOf, smoothed: Level, grid: Grid, target: AnyChessboard) -> Grid:
    """The lattice without outermost lines that few points make, each less like a corner, beside a line that is full.

    As long as it is larger than the board, without outermost lines beyond which no squares follow, too: on the margin
    the edges of shadows make points that look like corners.
    """
    like, points = looks(smoothed, grid)[0], grid.points.copy()
    typical = median_of_known(like)
    for own, beside in ((0, 1), (-1, -2)):
        for axis in (0, 1):
            line = np.take(like, own, axis)
            is_sparse = np.mean(np.isfinite(line)) <= CHANCE_SHARE and np.all(np.take(grid.known, beside, axis))
            if is_sparse and median_of_known(line) < CHANCE_LIKENESS * typical:
                points[(slice(None),) * axis + (own,)] = np.nan
    grid = grid.with_points(points).cropped()
    return _without_end_lines(level, grid, target) if _is_too_large(grid, target) else grid


def _without_end_lines(level: LevelOf, grid: Grid, target: AnyChessboard) -> Grid:
    """Without outermost lines, those that look least like corners first, until it is as large as the board or all do.

    A lattice that is larger by many lines is left as it is.
    """
    is_near = sum(grid.points.shape[:2]) <= sum(target.inner) + MOST_END_LINES
    board = _map(grid, level) if is_near and np.sum(grid.known) >= LEAST_POINTS else None
    if board is None:
        return grid
    part, (rows, columns) = grid, grid.points.shape[:2]
    ends = np.array(((0, columns - 1), (0, rows - 1)))
    for _ in range(MOST_END_LINES):
        lines = [Line(axis, int(ends[axis, k]), 2 * k - 1, *ends[1 - axis].tolist()) for axis in (0, 1) for k in (0, 1)]
        shares = [_share_of_corners(level, grid, board, line) for line in lines]
        least = int(np.argmin(shares))
        if shares[least] >= MOST or not _is_too_large(part, target) or np.any(ends[:, 0] >= ends[:, 1]):
            break
        ends.flat[least] -= lines[least].out
        (left, right), (top, bottom) = ends.tolist()
        points = np.full_like(grid.points, np.nan)
        points[top : bottom + 1, left : right + 1] = grid.points[top : bottom + 1, left : right + 1]
        part = grid.with_points(points).cropped()
    return part


def _share_of_corners(level: LevelOf, grid: Grid, board: BoardMap, line: Line) -> float:
    """Of the points that are known on a line, those around which squares look as around a corner; 0 of none.

    A line that is covered in part has few points, but these are corners.
    """
    across = grid.known[:, line.place] if line.axis == 0 else grid.known[line.place]
    places = corner_places(level.grey, board, line, grid.white_first)
    told = places[across[line.first : line.last + 1] & np.isfinite(places)]
    return float(np.mean(told)) if len(told) else 0.0


def _firm_part(smoothed: Level, grid: Grid) -> Grid:
    """The lattice up to the last columns and rows with more than one point that looks much like a corner."""
    like, contrast = looks(smoothed, grid)
    typical = median_of_known(like)
    if not typical >= LEAST_TYPICAL:
        return grid.with_points(np.full_like(grid.points, np.nan)).cropped()
    firm = (like > FIRM * typical) & (contrast > FIRM_CONTRAST * median_of_known(contrast))  # NaN is not
    rows, columns = np.flatnonzero(firm.sum(axis=1) > 1), np.flatnonzero(firm.sum(axis=0) > 1)
    points = np.full_like(grid.points, np.nan)
    if len(rows) and len(columns):
        part = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
        points[part] = grid.points[part]
    return grid.with_points(points).cropped()


def _map(grid: Grid, level: LevelOf) -> BoardMap | None:
    """From column and row of the lattice to the level; None where no camera could see its points so."""
    y, x = np.nonzero(grid.known)
    at, size = np.stack((x, y), axis=1).astype(np.float64), (level.grey.shape[1], level.grey.shape[0])
    try:
        points = np.ascontiguousarray(grid.points[y, x])  # in another layout the fit would be compiled anew
        return BoardMap.fit(at, points, size, np.ones(len(at)), hold=SEEN_CORNERS)
    except np.linalg.LinAlgError:
        return None


def _without_outliers(grid: Grid, level: LevelOf, side: float) -> tuple[Grid, BoardMap | None]:
    """The lattice's points that lie near the map through them, and that map."""
    board = _map(grid, level)
    if board is None:
        return grid, None
    rows, columns = grid.points.shape[:2]
    y, x = np.mgrid[0:rows, 0:columns]
    expected = board(np.stack((x.ravel(), y.ravel()), axis=1).astype(np.float64)).reshape(rows, columns, 2)
    far = np.linalg.norm(grid.points - expected, axis=-1) > FARTHEST_OFF * side
    if not np.any(far) or np.sum(grid.known & ~far) < LEAST_POINTS:
        return grid, board
    grid = grid.with_points(np.where(far[..., None], np.nan, grid.points))
    return grid, _map(grid, level)


def _is_smooth(grid: Grid, board: BoardMap, side: float) -> bool:
    """Whether the points lie where the map through them says, but for what finding them leaves."""
    y, x = np.nonzero(grid.known)
    square = np.sum((board(np.stack((x, y), axis=1).astype(np.float64)) - grid.points[y, x]) ** 2)
    free = max(1.0, 2.0 * len(x) - PARAMETERS)
    return bool(np.sqrt(square / free) < MOST_ROUGH * side)


def _bridged(level: LevelOf, smoothed: Level, grid: Grid, target: AnyChessboard) -> Grid:
    """The lattice with its points beyond what hides others, where the board may reach that far."""
    most = max(target.inner)
    gap = min(FARTHEST_GAP, most - min(grid.points.shape[:2]))
    board = _map(grid, level) if gap > 0 and np.sum(grid.known) >= LEAST_POINTS else None
    if board is None:
        return grid
    wide = grid.padded(gap)
    rows, columns = wide.points.shape[:2]
    y, x = np.mgrid[0:rows, 0:columns]
    cells = np.stack((x.ravel(), y.ravel()), axis=1) - float(gap)
    found = look_at(smoothed, wide, board(cells).reshape(rows, columns, 2), contrast_of(smoothed, grid))
    if not np.any(np.isfinite(found)):
        return grid
    return grow(smoothed, wide.with_points(np.where(wide.known[..., None], wide.points, found)).cropped(), most + 2)


def _on_board(smoothed: Level, grid: Grid, board: BoardMap, placement: Placement, target: AnyChessboard) -> Grid:
    """The board's own grid of corners: those of the lattice, and others that are seen where the map puts them."""
    across, down = target.inner
    y, x = np.mgrid[0:down, 0:across]
    cells = (np.stack((x, y), axis=-1) - placement.offset) @ placement.turn  # of the board's corners in the lattice
    column, row = np.moveaxis(cells, -1, 0)
    rows, columns = grid.points.shape[:2]
    within = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    points = np.full((down, across, 2), np.nan)
    points[within] = grid.points[row[within], column[within]]
    own = Grid(points, white_first=False)
    expected = board(cells.reshape(-1, 2).astype(np.float64)).reshape(points.shape)
    found = look_at(smoothed, own, expected, contrast_of(smoothed, grid), FARTHEST_OFF)
    return own.with_points(np.where(own.known[..., None], points, found))

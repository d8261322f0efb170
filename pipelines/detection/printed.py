"""Points of a printed board in an image: a finder says which is where, our fits place them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap, Lift
from pipelines.detection.circle_grids import find_circle_grid, opencv_centres, refine_circles
from pipelines.detection.consistency import Corners, check_placed
from pipelines.detection.corner_sites import CornerSites
from pipelines.detection.corners import refine_corners
from pipelines.detection.finders import find_board, subpix
from pipelines.detection.first_map import OUTLIER_PX, SEEN_CORNERS
from pipelines.detection.grey_picture import Grey
from pipelines.detection.markers import find_aprilgrid, find_charuco
from pipelines.detection.seen_points import SeenPoints
from pipelines.detection.statuses import PointStatus
from pipelines.detection.time_limit import Check, unlimited
from render.targets.aprilgrid import BORDER_MODULES, AprilGrid, tag_bits
from render.targets.charuco import Charuco
from render.targets.circle_grid import CircleGrid
from render.targets.plain_chessboard import PlainChessboard
from render.targets.printed import PrintedBoard

LEAST_SEEN = 6  # points that a first map is made from
GENTLE_PX = 0.5  # distance at which a seen point's weight in the first map is one half, where some are far off
BORDER_PX = 3.0  # a point nearer to the picture's border than this is not looked for


def find_points(image: Grey, target: PrintedBoard, check_time: Check = unlimited) -> SeenPoints | PointStatus:
    """Points of the target as a finder sees them, or the status of all if it sees too few, or not which they are."""
    seen: SeenPoints | PointStatus | None = None
    if isinstance(target, Charuco):
        seen = find_charuco(image, target)
    elif isinstance(target, AprilGrid):
        seen = find_aprilgrid(image, target)
    elif isinstance(target, CircleGrid):
        seen = find_circle_grid(image, target, check_time=check_time)
    elif isinstance(target, PlainChessboard):
        seen = find_board(image, target, check_time=check_time)
    if isinstance(seen, PointStatus):
        return seen
    return seen if seen is not None and len(seen.ids) >= LEAST_SEEN else PointStatus.BOARD_NOT_FOUND


def place_points(image: Grey, seen: SeenPoints, target: PrintedBoard, check_time: Check = unlimited) -> Corners:
    """All points of the target, placed by our fits; consistent are those that agree with the others.

    Raises:
        LinAlgError: points that no camera could see.
    """
    unit = target.unit_mm
    check_time()
    at, size = target.pattern_points / unit, (image.shape[1], image.shape[0])
    board = _first_map(seen, at, size, _lift(target, unit))
    if isinstance(target, CircleGrid):
        return refine_circles(image, board, target, unit)
    sites = corner_sites(target)
    if seen.exchanged:
        sites = replace(sites, sense=-sites.sense)
    inside = _is_inside(board(at), size)
    read = np.zeros(len(at), bool)
    read[seen.ids] = True
    corners = refine_corners(image, board, sites.chosen(inside), check_time=check_time)
    chosen = inside
    if not np.any(corners.consistent) and np.any(inside & read) and not np.all(read[inside]):
        chosen = inside & read  # most of the others may be covered
        corners = refine_corners(image, board, sites.chosen(chosen), check_time=check_time)
    return _spread(corners, chosen)


def check_seen(image: Grey, seen: SeenPoints, placed: Corners, target: PrintedBoard) -> Corners:
    """The points as OpenCV places them, by `cv2.cornerSubPix` or, discs, its blobs; checked as our own are."""
    place = opencv_centres if isinstance(target, CircleGrid) else subpix
    points = place(image, seen.points_px)
    at, size = target.pattern_points[seen.ids] / target.unit_mm, (image.shape[1], image.shape[0])
    chosen = np.zeros(len(placed.points_px), bool)
    chosen[seen.ids] = True
    order = np.argsort(seen.ids)
    checked = check_placed(points[order], placed, at[order], size)
    return _spread(checked, chosen)


def corner_sites(target: PrintedBoard) -> CornerSites:
    """Where the target's points are corners, and what lies around them."""
    unit, lattice = target.unit_mm, target.lattice()
    points = target.pattern_points
    before = points - 0.25 * lattice.least_gap_mm
    columns, rows = (
        np.searchsorted(lines, before[:, k]) - 1 for k, lines in enumerate((lattice.x_lines, lattice.y_lines))
    )
    sense = np.where(lattice.black[rows, columns], 1.0, -1.0)
    sites = CornerSites(points / unit, sense)
    if isinstance(target, Charuco):
        return replace(sites, clear=0.5 * (1.0 - target.marker_mm / target.square_mm))
    if isinstance(target, AprilGrid):
        gap, border = target.spacing, BORDER_MODULES / (len(tag_bits(0)) + 2 * BORDER_MODULES)
        return replace(sites, next_edge=gap, reach=gap, least_reach=0.5 * gap, clear=min(border, gap))
    return sites


def _lift(target: PrintedBoard, unit: float) -> Lift | None:
    """The bent or scaled sheet in units; None where the print is flat and as drawn."""
    if target.bend_sag_mm == 0.0 and target.print_scale == (1.0, 1.0):
        return None
    sheet = target.sheet
    return lambda at: sheet.lift(at * unit) / unit


def _first_map(seen: SeenPoints, at: Array, size: tuple[int, int], lift: Lift | None) -> BoardMap:
    """The map through what was seen, of which some may be a few pixels off."""
    points, weights = np.zeros((len(at), 2)), np.zeros(len(at))
    points[seen.ids], weights[seen.ids] = seen.points_px, 1.0
    board = BoardMap.fit(at, points, size, weights, hold=SEEN_CORNERS, lift=lift)
    distance = np.linalg.norm(board(at) - points, axis=1)
    if distance[seen.ids].max() <= OUTLIER_PX:
        return board
    return BoardMap.fit(at, points, size, weights / (1.0 + (distance / GENTLE_PX) ** 2), board, SEEN_CORNERS)


def _is_inside(points: Array, size: tuple[int, int]) -> Mask:
    """(n,) which pixels lie in the picture, a little from its border."""
    return np.all((points >= BORDER_PX) & (points <= np.array(size) - 1.0 - BORDER_PX), axis=1)


def _spread(corners: Corners, chosen: Mask) -> Corners:
    """Corners of chosen points as those of all; the others are not consistent."""
    n = len(chosen)
    points, covariance, consistent = np.full((n, 2), np.nan), np.full((n, 2, 2), np.nan), np.zeros(n, bool)
    points[chosen], covariance[chosen], consistent[chosen] = (
        corners.points_px, corners.covariance_px2, corners.consistent,
    )  # fmt: skip
    return replace(corners, points_px=points, covariance_px2=covariance, consistent=consistent)

"""What one small cell of the picture sees of the target, in Dr.Jit: its mean radiance, by closed forms.

One ray goes through the cell's centre and meets the planes of the circle and of the board. With the ray's change
over the cell every edge is a straight line across the cell, whose share on either side is known (`edge_coverage`).
Where several edges cross one cell, their shares are multiplied as if they were independent.
"""

from __future__ import annotations

from dataclasses import dataclass

from render import backend
from render.analytic.board_reflectance import EDGE_REACH, MANY_EDGES, SMOOTH, linear_steps, sample_board
from render.analytic.device_print import DevicePrint
from render.analytic.device_target import DeviceTarget, shading_at
from render.analytic.edge_coverage import half_range, positive_share
from render.analytic.plane_hit import PlaneHit, distance_from, meet_plane
from render.analytic.print_reflectance import sample_print
from render.analytic.rays import DeviceCamera, RayBundle
from render.analytic.sheet_hit import meet_sheet
from render.device import DeviceBool, DeviceFloat, DeviceIndex


@dataclass(frozen=True, slots=True)
class CellSample:
    """What cells see."""

    radiance: DeviceFloat  # of the target alone: a cell that it fills by half has half
    filled: DeviceFloat  # the target's share of the cell
    edges: DeviceIndex  # SMOOTH, ONE_EDGE or MANY_EDGES


def sample_cells(
    target: DeviceTarget | DevicePrint, camera: DeviceCamera, x_px: DeviceFloat, y_px: DeviceFloat, size: DeviceFloat
) -> CellSample:
    """What cells see whose centres are at x_px, y_px and whose sides are `size`, px."""
    rays = camera.rays(x_px, y_px)
    if isinstance(target, DevicePrint):
        return _sample_print(target, rays, size)
    return _sample_chessboard(target, rays, size)


def _sample_print(target: DevicePrint, rays: RayBundle, size: DeviceFloat) -> CellSample:
    """A printed board, which may be bent."""
    mi, dr = backend.load(), backend.jit()
    hit, front = meet_sheet(rays, target.sheet, size)
    board = sample_print(target, hit)
    share = dr.select(hit.met & rays.seen, board.share, 0.0)
    radiance = dr.select(front, share * board.reflectance * shading_at(target, hit.x, hit.y), 0.0)
    return CellSample(radiance, share, mi.UInt32(dr.select(hit.met, board.edges, SMOOTH)))


def _sample_chessboard(target: DeviceTarget, rays: RayBundle, size: DeviceFloat) -> CellSample:
    """The flat chessboard and its raised circle."""
    mi, dr = backend.load(), backend.jit()
    disc, rim, within_disc = _sample_disc(target, meet_plane(rays, target.disc.z, size))
    hit = meet_plane(rays, 0.0, size)
    board = sample_board(target, hit)
    board_edges = dr.select(hit.met, dr.select(_may_be_shadowed(target, hit), MANY_EDGES, board.edges), SMOOTH)
    edges = dr.select(rim, MANY_EDGES, dr.select(within_disc, SMOOTH, board_edges))
    board_share = (1.0 - disc) * dr.select(hit.met, board.share, 0.0)
    shading = shading_at(target, hit.x, hit.y)
    radiance = disc * target.disc.radiance + board_share * board.reflectance * shading
    front = rays.direction.z > 0.0  # no light falls on the back of board and disc
    seen = dr.select(rays.seen, 1.0, 0.0)
    return CellSample(dr.select(front, radiance, 0.0) * seen, (disc + board_share) * seen, mi.UInt32(edges))


def _sample_disc(target: DeviceTarget, hit: PlaneHit) -> tuple[DeviceFloat, DeviceBool, DeviceBool]:
    """The disc's share of cells, whether its rim crosses them, and whether they lie wholly within it."""
    dr = backend.jit()
    radius = target.disc.radius
    distance, steps = distance_from(hit, target.disc.x, target.disc.y)
    share = dr.select(hit.met, positive_share(radius - distance, *linear_steps(steps, target)), 0.0)
    rim = hit.met & (dr.abs(distance - radius) <= EDGE_REACH * half_range(*steps))
    return share, rim, hit.met & ~rim & (distance < radius)


def _may_be_shadowed(target: DeviceTarget, hit: PlaneHit) -> DeviceBool:
    """Whether the lamp's shadow of the disc may fall on cells of the board; it has an edge as a square has."""
    distance, steps = distance_from(hit, target.disc.x, target.disc.y)
    return distance <= target.disc.shadow_radius + EDGE_REACH * half_range(*steps)

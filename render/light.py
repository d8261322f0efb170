"""Light on the target: one square lamp and an even surrounding, fixed to the board, so that every frame is lit alike.

Radiance is relative: 1 is the white board at the board's centre without shadows.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from eposit.arrays import Array
from render.targets import Target
from render.targets.chessboard import Chessboard
from render.targets.disc_shade import blocked_share

GRID_SHARE = 0.01  # spacing of the map of the light in squares: 1 mm on the paper's board, a third of the penumbra
LAMP_SAMPLES = 48  # lamp positions along each side for the circle's shadow
SHEET_TEXELS = 200  # of the map along each side of a board without a shadow
SMOOTH_SAMPLES = 6  # Gauss-Legendre nodes along each side where nothing casts a shadow


@dataclass(frozen=True, slots=True, kw_only=True)
class Light:
    """Lamp, surrounding and background.

    Raises:
        ValueError: a lamp behind the board, a size that is not positive, or a share outside [0, 1].
    """

    lamp_position_mm: Annotated[tuple[float, float, float], "lamp's centre in the object frame, mm"] = (
        -400.0,
        -900.0,
        -2600.0,
    )
    lamp_side_mm: Annotated[float, "side of the square lamp, which faces the board's centre, mm"] = 900.0
    ambient_share: Annotated[float, "share of the even surrounding in the light at the board's centre, 0 to 1"] = 0.3
    background: Annotated[float, "radiance of what lies behind the board; 1 is the white board at its centre"] = 0.3

    def __post_init__(self) -> None:
        if not self.lamp_position_mm[2] < 0.0:
            raise ValueError(
                f"light lamp_position_mm has z = {self.lamp_position_mm[2]}; the lamp stands in front at z < 0"
            )
        if not self.lamp_side_mm > 0.0:
            raise ValueError(f"light lamp_side_mm is {self.lamp_side_mm}; it must be above 0 mm")
        if not 0.0 <= self.ambient_share <= 1.0:
            raise ValueError(f"light ambient_share is {self.ambient_share}; it must lie in 0 to 1")
        if not 0.0 <= self.background <= 10.0:
            raise ValueError(f"light background is {self.background}; it must lie in 0 to 10")

    def lamp_corners(self, target: Target) -> Array:
        """(4, 3) corners of the lamp in the object frame, mm, in order around its border."""
        centre = np.array(self.lamp_position_mm)
        toward = target.board_centre - centre
        toward = toward / np.linalg.norm(toward)
        side = np.cross(toward, np.array([0.0, 1.0, 0.0]))
        side = side / np.linalg.norm(side)
        up = np.cross(side, toward)
        half = self.lamp_side_mm / 2.0
        return np.array([centre + half * (a * side + b * up) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def shading_map(target: Chessboard, light: Light) -> tuple[Array, float]:
    """Radiance over reflectance, and the same on the circle.

    Returns:
        (rows, columns) map over `target.extent_mm`, samples at texel centres, x along columns; and one number for
        the circle, which nothing shades. The board's white at its centre, without shadows, has radiance 1.
    """
    x0, x1, y0, y1 = target.extent_mm
    spacing = GRID_SHARE * target.square_mm
    nx, ny = round((x1 - x0) / spacing), round((y1 - y0) / spacing)
    x, y = x0 + (np.arange(nx) + 0.5) * (x1 - x0) / nx, y0 + (np.arange(ny) + 0.5) * (y1 - y0) / ny
    points = np.stack((*np.meshgrid(x, y), np.zeros((ny, nx))), axis=-1)
    lamp = _smooth_lamp(target, light, points)
    centre = target.circle_centre
    distance = np.hypot(points[..., 0] - centre[0], points[..., 1] - centre[1])
    near = distance < shadow_radius(target, light)
    lamp[near] = lamp_irradiance(target, light, points[near], LAMP_SAMPLES, shadowed=True)
    blocked = blocked_share(distance, target.circle_radius_mm, target.circle_height_mm)
    ambient = 1.0 - blocked - lamp / np.pi  # neither the circle nor the lamp lets it through
    lamp_here, ambient_here = reference_irradiance(target, light)
    disc = lamp_irradiance(target, light, centre[None], SMOOTH_SAMPLES, shadowed=False)[0]
    lamp_scale = (1.0 - light.ambient_share) / lamp_here / target.white
    ambient_scale = light.ambient_share / ambient_here / target.white
    return lamp_scale * lamp + ambient_scale * ambient, lamp_scale * disc + ambient_scale * (1.0 - disc / np.pi)


def shadow_radius(target: Chessboard, light: Light) -> float:
    """Distance from the circle's axis, mm, within which the lamp's shadow of it lies on the board."""
    to_lamp = light.lamp_corners(target) - target.circle_centre
    slope = np.max(np.linalg.norm(to_lamp[:, :2] / to_lamp[:, 2:], axis=1))
    return float(target.circle_radius_mm + 1.1 * target.circle_height_mm * slope + 2.0 * GRID_SHARE * target.square_mm)


def reference_irradiance(target: Target, light: Light) -> tuple[float, float]:
    """Irradiance of a lamp of unit radiance, and the share of the surrounding it leaves, at the board's centre."""
    lamp = float(lamp_irradiance(target, light, target.board_centre[None], SMOOTH_SAMPLES, shadowed=False)[0])
    return lamp, 1.0 - lamp / np.pi


def _smooth_lamp(target: Chessboard, light: Light, points: Array) -> Array:
    """Unshadowed lamp on a coarse grid, interpolated: it varies over metres."""
    step = 10
    rows, columns = points.shape[:2]
    iy, ix = np.arange(0, rows + step, step), np.arange(0, columns + step, step)
    origin, dx, dy = points[0, 0], points[0, 1] - points[0, 0], points[1, 0] - points[0, 0]
    coarse = origin + ix[None, :, None] * dx + iy[:, None, None] * dy
    values = lamp_irradiance(target, light, coarse.reshape(-1, 3), SMOOTH_SAMPLES, shadowed=False).reshape(
        coarse.shape[:2]
    )
    across = np.stack([np.interp(np.arange(columns), ix, row) for row in values])
    return np.stack([np.interp(np.arange(rows), iy, column) for column in across.T], axis=1)


def sheet_shading_map(target: Target, light: Light) -> Array:
    """(SHEET_TEXELS, SHEET_TEXELS) radiance over reflectance of a printed board, which may be bent.

    Over the nominal extent of its sheet, samples at texel centres, x along columns. The board's white at its centre has
    radiance 1. Each place has the lamp and the surrounding that its own normal faces; light from one part of a hollow
    board on another, which is less than (4 sag / width)^2 of all, is left out, and so is the shade of its borders.
    """
    x0, x1, y0, y1 = target.sheet.extent_mm
    share = (np.arange(SHEET_TEXELS) + 0.5) / SHEET_TEXELS
    at = np.stack(np.meshgrid(x0 + (x1 - x0) * share, y0 + (y1 - y0) * share), axis=-1).reshape(-1, 2)
    points, normals = target.sheet.lift(at), target.sheet.normals(at)
    lamp = lamp_irradiance(target, light, points, SMOOTH_SAMPLES, shadowed=False, normals=normals)
    lamp_here, ambient_here = reference_irradiance(target, light)
    lit = (1.0 - light.ambient_share) * lamp / lamp_here + light.ambient_share * (1.0 - lamp / np.pi) / ambient_here
    return (lit / target.white).reshape(SHEET_TEXELS, SHEET_TEXELS)


def lamp_irradiance(
    target: Target, light: Light, points: Array, samples: int, *, shadowed: bool, normals: Array | None = None
) -> Array:
    """Irradiance of a lamp of unit radiance at (n, 3) points, by quadrature over the lamp's area.

    normals: (n, 3) unit vectors that the points face; -z if left out. shadowed: whether the circle of a chessboard
    keeps light away. samples: along each side of the lamp. Gauss-Legendre where nothing casts a shadow, so that six are
    exact to nine digits; the midpoint rule where the circle's shadow jumps within the lamp.
    """
    corners = light.lamp_corners(target)
    edge_a, edge_b = corners[1] - corners[0], corners[3] - corners[0]
    normal = np.cross(edge_a, edge_b)
    area = float(np.linalg.norm(normal))
    normal = normal / area
    shares, weights = _midpoint_rule(samples) if shadowed else _gauss_legendre_rule(samples)
    px, py, pz = np.ascontiguousarray(points.T)
    total = np.zeros(len(points))
    for (a, weight_a), (b, weight_b) in itertools.product(zip(shares, weights, strict=True), repeat=2):
        lx, ly, lz = corners[0] + a * edge_a + b * edge_b
        x, y, z = lx - px, ly - py, lz - pz
        distance2 = x * x + y * y + z * z
        cosines = _toward(x, y, z, normals) * np.abs(x * normal[0] + y * normal[1] + z * normal[2])
        value = cosines * (area * weight_a * weight_b) / (distance2 * distance2)
        if shadowed:
            assert isinstance(target, Chessboard)  # no other target casts a shadow
            cx, cy, cz = target.circle_centre
            share = (pz - cz) / -z  # of the way to the lamp, to the circle's plane
            across, down = px + x * share - cx, py + y * share - cy
            value[across * across + down * down < target.circle_radius_mm**2] = 0.0
        total += value
    return total


def _toward(x: Array, y: Array, z: Array, normals: Array | None) -> Array:
    """(n,) vectors' components along the normals, 0 where they point away."""
    if normals is None:
        return np.maximum(-z, 0.0)
    return np.maximum(x * normals[:, 0] + y * normals[:, 1] + z * normals[:, 2], 0.0)


def _midpoint_rule(samples: int) -> tuple[Array, Array]:
    """(samples,) nodes and weights on [0, 1]."""
    return (np.arange(samples) + 0.5) / samples, np.full(samples, 1.0 / samples)


def _gauss_legendre_rule(samples: int) -> tuple[Array, Array]:
    """(samples,) nodes and weights on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(samples)
    return 0.5 + 0.5 * nodes, 0.5 * weights

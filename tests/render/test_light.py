"""The light on the board: lamp and surrounding against closed forms and sums over areas."""

import numpy as np
import pytest

from render.light import GRID_SHARE, Light, lamp_irradiance, shading_map
from render.targets.chessboard import Chessboard

TARGET, LIGHT = Chessboard(), Light()


def test_lamp_irradiance_is_the_polygon_formula():
    """Lambert's closed form for a polygon of unit radiance, from Baum et al. 1989."""
    points = np.array([[0.0, 0.0, 0.0], [400.0, 250.0, 0.0], [900.0, 600.0, 0.0]])
    found = lamp_irradiance(TARGET, LIGHT, points, 6, shadowed=False)
    midpoint = lamp_irradiance(TARGET, LIGHT, points, 48, shadowed=True)  # the shade is elsewhere
    for point, value, rough in zip(points, found, midpoint, strict=True):
        corners = LIGHT.lamp_corners(TARGET) - point
        unit = corners / np.linalg.norm(corners, axis=1, keepdims=True)
        total = np.zeros(3)
        for a, b in zip(unit, np.roll(unit, -1, axis=0), strict=True):
            cross = np.cross(a, b)
            total += np.arccos(a @ b) * cross / np.linalg.norm(cross)
        assert value == pytest.approx(abs(0.5 * total @ [0, 0, -1]), rel=1e-11)  # six Gauss nodes on 0.31 rad
        # Midpoint rule, 48^2 points on 0.31 rad: (0.31 / 48)^2 / 24 times the bend of cos^4 on both axes, 8: 1.4e-5.
        assert rough == pytest.approx(abs(0.5 * total @ [0, 0, -1]), rel=3e-5)


def light_past_the_disc(distance, radius, height):
    """Share of an even hemisphere's light that passes a disc, by a sum over the disc's area.

    A piece dA of the disc at the distance d takes cos^2 dA / (pi d^2), and cos = height / d (Lambert's cosine law for
    two parallel surfaces). Under the disc's centre the integral is 1 - r^2 / (r^2 + h^2).
    """
    nodes, weights = np.polynomial.legendre.leggauss(64)
    r, weights = 0.5 * radius * (1.0 + nodes), 0.5 * radius * weights
    angle = np.arange(256) * (2.0 * np.pi / 256)
    x, y = r * np.cos(angle[:, None]) - distance, r * np.sin(angle[:, None])
    taken = height**2 / np.pi / (x * x + y * y + height**2) ** 2
    return 1.0 - np.sum(taken * r * weights) * (2.0 * np.pi / 256)


def test_the_surrounding_alone_leaves_a_shadow_under_the_disc():
    """All light from the surrounding, and a lamp too small to hide any of it: only the disc keeps light away."""
    radius, height = TARGET.circle_radius_mm, TARGET.circle_height_mm
    assert light_past_the_disc(0.0, radius, height) == pytest.approx(1.0 - 900.0 / 1000.0, abs=1e-12)
    shading, on_disc = shading_map(TARGET, Light(ambient_share=1.0, lamp_side_mm=0.1))
    assert on_disc * TARGET.white == pytest.approx(1.0, abs=1e-6)  # nothing shades the disc
    x0, _, y0, _ = TARGET.extent_mm
    step = GRID_SHARE * TARGET.square_mm
    foot = TARGET.circle_centre
    row = round((foot[1] - y0) / step)
    y = y0 + (row + 0.5) * step
    for column in round((foot[0] - x0) / step) + np.array([0, 10, 20, 29, 30, 45, 60, 200]):
        x = x0 + (column + 0.5) * step
        expected = light_past_the_disc(np.hypot(x - foot[0], y - foot[1]), radius, height)
        assert shading[row, column] * TARGET.white == pytest.approx(expected, abs=1e-6)

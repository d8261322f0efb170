"""The board as triangles: their areas, their places and their colours."""

import numpy as np
import pytest

from render.targets.charuco import Charuco
from render.targets.chessboard import Chessboard
from render.targets.circle_grid import CircleGrid
from render.targets.mesh import CHORD_MM, board_mesh
from render.targets.plain_chessboard import PlainChessboard
from render.targets.sheet import Sheet

TARGETS = [
    Chessboard(),
    Charuco(columns=4, rows=3),
    PlainChessboard(columns=4, rows=3, bend_sag_mm=8.0, margin_mm=0.0),
    CircleGrid(columns=3, rows=3, bend_sag_mm=6.0, bend_axis="both", print_scale=(1.01, 0.99)),
]


def colours(mesh):
    """(m,) reflectance of each triangle, whose corners must agree, and lie within a texel."""
    place = mesh.uv[mesh.faces] * mesh.reflectance.shape[::-1]
    texel = np.floor(place).astype(int)
    assert np.all(np.abs(place - texel - 0.5) < 1e-6)
    found = mesh.reflectance[texel[..., 1], texel[..., 0]]
    assert np.all(found == found[:, :1])
    return found[:, 0]


@pytest.mark.parametrize("target", TARGETS)
def test_triangles_cover_the_board_once_in_the_colours_of_the_print(target):
    mesh = board_mesh(target)
    corners = mesh.vertices[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(normal[:, 2] <= 0.0)  # seen from the front
    area = 0.5 * np.abs(normal[:, 2])  # on the plane z = 0
    lattice, sheet = target.lattice(), target.sheet
    x0, x1, y0, y1 = sheet.extent_mm
    scale = np.prod(sheet.scale)
    if target.front_mm >= 0.0 and getattr(target, "bend_axis", "x") == "x" and sheet.sag_mm:
        fine = sheet.lift(np.stack((np.linspace(x0, x1, 3), np.full(3, y0)), axis=1))
        assert area.sum() == pytest.approx((fine[-1, 0] - fine[0, 0]) * (y1 - y0), rel=1e-9)
        return
    black = np.sum(lattice.black * np.diff(lattice.x_lines) * np.diff(lattice.y_lines)[:, None])
    black += np.count_nonzero(lattice.discs) * np.pi * lattice.disc_radius_mm**2
    assert area.sum() == pytest.approx((x1 - x0) * (y1 - y0) * scale, rel=1e-9)
    assert area[colours(mesh) == np.float32(target.black)].sum() == pytest.approx(black * scale, rel=1e-9)


def test_triangles_follow_a_bent_sheet():
    target = PlainChessboard(bend_sag_mm=20.0, bend_axis="both")
    mesh, flat = board_mesh(target), Sheet(target.sheet.extent_mm)
    middles = 0.5 * (mesh.vertices[mesh.faces] + np.roll(mesh.vertices[mesh.faces], 1, axis=1)).reshape(-1, 3)
    on_sheet = target.sheet.lift(middles[:, :2])  # bent along both axes it keeps x and y
    assert np.abs(on_sheet[:, 2] - middles[:, 2]).max() < 2.0 * CHORD_MM  # diagonals bend twice
    np.testing.assert_allclose(flat.lift(middles[:, :2])[:, :2], middles[:, :2])
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)

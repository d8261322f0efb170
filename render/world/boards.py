"""The target and other boards as shapes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from eposit.arrays import Array
from render import backend
from render.targets.chessboard import Chessboard
from render.targets.kinds import AnyTarget
from render.targets.mesh import Mesh, board_mesh
from render.world.materials import Material, diffuse
from render.world.shapes import FRONT, RIGHT, UP, MeshShape, Objects, Shape, box, frame_matrix, pole

BOARD, CIRCLE = "board", "circle"
BACK = (0.3, 0.3, 0.3)  # reflectance of a board's back
Coat = Callable[[Material], Material]  # from a reflectance to the surface that has it


def target_shapes(target: AnyTarget, coat: Coat) -> Objects:
    """The printed board, and the raised circle of a target that has one, which is of matt paper on every board."""
    mesh = board_mesh(target)
    board = {BOARD: MeshShape(mesh, coat(_print(mesh)))}
    return board | ({CIRCLE: circle_shape(target)} if isinstance(target, Chessboard) else {})


def circle_shape(target: Chessboard) -> Shape:
    """The raised disc, seen from the front."""
    radius = target.circle_radius_mm
    matrix = frame_matrix(radius * RIGHT, -radius * UP, -FRONT, target.circle_centre)
    paper = {"type": "diffuse", "reflectance": {"type": "uniform", "value": target.circle}}
    return {"type": "disk", "flip_normals": True, "to_world": matrix, "bsdf": paper}


def card_shapes(target: AnyTarget) -> Objects:
    """A matt card as white as the board in the board's place, to meter light on."""
    return {BOARD: MeshShape(board_mesh(target), diffuse((target.white, target.white, target.white)))}


def stand_shapes(target: AnyTarget, floor_mm: float) -> Objects:
    """A thin plate behind the board, a pole and a foot, so that it does not float."""
    sheet, centre = target.sheet, target.board_centre
    deepest = max(0.0, sheet.sag_mm) * -FRONT  # of a bent board, behind its middle
    width, height = (2.0 * sheet.half_sides).tolist()
    middle = centre + deepest + 30.0 * -FRONT
    ground = middle - floor_mm * UP
    return {
        "stand_plate": box(centre + deepest + 8.0 * -FRONT, (width, height, 12.0), 0.0, diffuse(BACK)),
        "stand_pole": pole(ground, middle, 22.0, diffuse((0.25, 0.25, 0.27))),
        "stand_foot": box(ground + 15.0 * UP, (500.0, 30.0, 500.0), 0.0, diffuse((0.2, 0.2, 0.22))),
    }


def other_board(columns: int, rows: int, square_mm: float, matrix: Array) -> Shape:
    """A plain chessboard without a circle. matrix: (4, 4) its frame, centre at the middle, z out of its front."""
    mi = backend.load()
    column, row = np.meshgrid(np.arange(columns), np.arange(rows))
    squares = np.pad(np.where((column + row) % 2 == 0, 0.06, 0.75), 1, constant_values=0.75).astype(np.float32)
    scale = np.diag([(columns + 2) * square_mm / 2.0, (rows + 2) * square_mm / 2.0, 1.0, 1.0])
    reflectance = {
        "type": "bitmap", "bitmap": mi.Bitmap(squares[..., None]), "raw": True, "filter_type": "nearest",
    }  # fmt: skip
    front = {"type": "diffuse", "reflectance": reflectance}
    return {"type": "rectangle", "to_world": matrix @ scale, "bsdf": {"type": "twosided", "inner": front}}


def _print(mesh: Mesh) -> Material:
    """The texture of a printed board: a texel for each cell."""
    return {
        "type": "bitmap",
        "bitmap": backend.load().Bitmap(mesh.reflectance[..., None]),
        "raw": True,
        "filter_type": "nearest",
        "wrap_mode": "clamp",
    }

"""The target and other boards as shapes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from eposit.arrays import Array
from render import backend
from render.targets.chessboard import Chessboard
from render.world.materials import Material, diffuse
from render.world.shapes import FRONT, UP, Objects, Shape, box, frame_matrix, pole

BOARD, CIRCLE = "board", "circle"
BACK = (0.3, 0.3, 0.3)  # reflectance of a board's back
Coat = Callable[[Material], Material]  # from a reflectance to the surface that has it


def target_shapes(target: Chessboard, coat: Coat) -> Objects:
    """Board and circle, seen from the front. The circle is of matt paper on every board."""
    return {BOARD: board_shape(target, coat), CIRCLE: circle_shape(target)}


def board_shape(target: Chessboard, coat: Coat) -> Shape:
    """The flat board with its margin."""
    mi = backend.load()
    x0, x1, y0, y1 = target.extent_mm
    # One texel per square with one ring of margin, clamped beyond: the texture's extent differs from the board's.
    square = target.square_mm
    width, height = (target.columns + 2) * square, (target.rows + 2) * square
    transform = mi.ScalarTransform4f
    to_uv = transform().translate([(x0 + 2.0 * square) / width, (y0 + 2.0 * square) / height, 0.0])
    to_uv = to_uv @ transform().scale([(x1 - x0) / width, (y1 - y0) / height, 1.0])
    reflectance = {
        "type": "bitmap",
        "bitmap": mi.Bitmap(target.reflectance()[..., None]),
        "raw": True,
        "filter_type": "nearest",
        "wrap_mode": "clamp",
        "to_uv": to_uv,
    }
    half_x, half_y, centre = np.zeros(3), np.zeros(3), np.zeros(3)
    half_x[0], half_y[1], centre[:2] = (x1 - x0) / 2.0, (y1 - y0) / 2.0, ((x0 + x1) / 2.0, (y0 + y1) / 2.0)
    return _facing_camera("rectangle", frame_matrix(half_x, half_y, -FRONT, centre), coat(reflectance))


def circle_shape(target: Chessboard) -> Shape:
    """The raised disc."""
    radius = target.circle_radius_mm
    matrix = frame_matrix(*(np.diag([radius, radius, 1.0])), target.circle_centre)
    paper = {"type": "diffuse", "reflectance": {"type": "uniform", "value": target.circle}}
    return _facing_camera("disk", matrix, paper)


def card_shapes(target: Chessboard) -> Objects:
    """A matt card as white as the board in the board's place, to meter light on."""
    return {BOARD: board_shape(target, lambda _: diffuse((target.white,) * 3))}


def stand_shapes(target: Chessboard, floor_mm: float) -> Objects:
    """A thin plate behind the board, a pole and a foot, so that it does not float."""
    x0, x1, y0, y1 = target.extent_mm
    middle = target.board_centre + 30.0 * -FRONT
    ground = target.board_centre - floor_mm * UP + 30.0 * -FRONT
    return {
        "stand_plate": box(
            np.array([(x0 + x1) / 2.0, (y0 + y1) / 2.0, 8.0]), (x1 - x0, y1 - y0, 12.0), 0.0, diffuse(BACK)
        ),
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


def _facing_camera(kind: str, matrix: Array, bsdf: Material) -> Shape:
    return {"type": kind, "flip_normals": True, "to_world": matrix, "bsdf": bsdf}

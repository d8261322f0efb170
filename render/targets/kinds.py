"""Every kind of target, by the name that a recipe gives it."""

from __future__ import annotations

from render.targets.aprilgrid import AprilGrid
from render.targets.charuco import Charuco
from render.targets.chessboard import Chessboard
from render.targets.circle_grid import CircleGrid
from render.targets.plain_chessboard import PlainChessboard

AnyTarget = Chessboard | PlainChessboard | Charuco | AprilGrid | CircleGrid
PATTERNS: dict[str, type[AnyTarget]] = {
    "chessboard": Chessboard,
    "plain_chessboard": PlainChessboard,
    "charuco": Charuco,
    "aprilgrid": AprilGrid,
    "circles": CircleGrid,
}

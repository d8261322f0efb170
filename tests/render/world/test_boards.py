"""What stands behind a target."""

import numpy as np
import pytest

from render.targets.chessboard import Chessboard
from render.targets.mesh import board_mesh
from render.targets.plain_chessboard import PlainChessboard
from render.world.boards import stand_shapes

BENT = [PlainChessboard(bend_sag_mm=sag, bend_axis=axis) for sag in (20.0, -20.0) for axis in ("x", "y", "both")]


@pytest.mark.parametrize("target", [Chessboard(), *BENT])
def test_no_part_of_the_stand_reaches_through_the_board(target):
    plate, pole, foot = (stand_shapes(target, 1500.0)[f"stand_{name}"] for name in ("plate", "pole", "foot"))
    deepest = board_mesh(target).vertices[:, 2].max()
    front = plate["to_world"][2, 3] - np.abs(plate["to_world"][2, :3]).sum()
    assert deepest < front < deepest + 10.0  # and it stands close behind
    radius = np.linalg.norm(pole["to_world"][:3, 0])
    assert pole["to_world"][2, 3] - radius > deepest
    assert foot["to_world"][1, 3] - target.board_centre[1] == pytest.approx(1500.0 - 15.0)

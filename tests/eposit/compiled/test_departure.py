"""How far the cost is from its parabola, against plain NumPy that goes to eight poses one after the other."""

import numpy as np
import pytest

from eposit.compiled import layout
from eposit.compiled.departure import DEVIATIONS, departure
from eposit.compiled.descent import MINIMUM, descend, moved
from eposit.compiled.linear6 import inverse
from eposit.compiled.model import cost_at
from tests.cameras import paper_camera, random_object, random_pose
from tests.eposit.compiled.workspace import call, problem, put_pose

SIGMA_PX = 2.0  # so that the cost is no parabola: ratios of 0.5 to 2


def least_known(C, first=None):
    """A step of one standard deviation along the least known rotation, or along that independent of `first`."""
    turn = np.ones(3) if first is None else first[[1, 2, 0]] - first[[2, 0, 1]]
    for _ in range(4):
        turn = C[:3, :3] @ turn
        if first is not None:
            turn = turn - first[:3] * (first[:3] @ turn) / (first[:3] @ first[:3])
        turn /= np.linalg.norm(turn)
    return C[:, :3] @ turn / np.sqrt(turn @ C[:3, :3] @ turn)


def one_by_one(w, n, C):
    """The largest |log|, and the widened inverse Hessian."""
    steps = np.array([first := least_known(C), least_known(C, first)])
    expected, ratios = (DEVIATIONS * SIGMA_PX) ** 2, []
    for angle in np.arange(8) * np.pi / 4:
        w[layout.MOVE : layout.MOVE + 6] = np.sqrt(expected) * np.array([np.cos(angle), np.sin(angle)]) @ steps
        call(moved, w, layout.MINIMA, layout.MOVE, layout.PROPOSAL)
        ratios.append((call(cost_at, w, n, layout.PROPOSAL) - w[layout.COSTS]) / expected)
    least = np.clip([min(ratios[0], ratios[4]), min(ratios[2], ratios[6])], 0.25, 1.0)
    return np.abs(np.log(ratios)).max(), C + steps.T * (1.0 / least - 1.0) @ steps


@pytest.mark.parametrize("n", [4, 7])
@pytest.mark.parametrize("lens", ["perspective", "equisolid", "stereographic", "kannala_brandt"])
def test_eight_directions_together_are_those_one_by_one(lens, n):
    rng, camera = np.random.default_rng(5), paper_camera(lens)
    for _ in range(5):
        points = random_object(rng, n)
        pose = random_pose(rng, points, 50.0, 0.1)
        pixels = camera.project(pose.apply(points)) + SIGMA_PX * rng.normal(size=(n, 2))
        w = problem(camera, points, pixels)
        put_pose(w, pose, layout.MINIMA)
        assert call(descend, w, n, layout.MINIMA, 0, layout.FACTORS, 1.0) == MINIMUM
        w[layout.COSTS] = w[layout.COST]
        call(inverse, w, layout.FACTORS, layout.HESSIAN)
        C = w[layout.HESSIAN : layout.HESSIAN + 36].reshape(6, 6)
        farthest, widened = one_by_one(w.copy(), n, C.copy())
        # Rounding of costs about 100 times a ratio's part, of a Hessian of condition 1e4.
        assert call(departure, w, n, SIGMA_PX**2) == pytest.approx(farthest, rel=1e-9)
        deviations = np.sqrt(np.diag(widened))
        np.testing.assert_allclose(
            C / np.outer(deviations, deviations), widened / np.outer(deviations, deviations), atol=1e-9
        )

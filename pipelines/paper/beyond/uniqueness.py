"""Whether a solution found by iterating is unique: fixed points that are proved single, missed and doubled."""

from __future__ import annotations

import numpy as np

from eposit import Pose
from eposit.arrays import Array, Mask
from eposit.pose import rotation_error_rad
from eposit.posit.iteration import posit
from eposit.posit.orthography import Orthography
from pipelines.pages.sections import Table
from pipelines.paper.claims import PaperSection, Statement, Verdict, holds_if
from pipelines.paper.problems import EXACT_RAD, OBJECT, SIDE_MM, at_angles, helix, turned
from pipelines.statistics import percent, wilson

LIMIT_DEG = 40.0  # all points of a random problem lie inside: EPOSIT's own limit is 54.7
FAR_DEG = 30.0
SIZES = (0.1, 0.3, 0.6)  # reach of random objects over their distance
CONDITION = 20.0  # of a random object's offsets: neither flat nor long
STARTS = 8
STEPS = 300
HEAD = (
    "problems", "how many", "one fixed point, proved", "iteration ends in the pose", "ends elsewhere", "does not end",
    f"another fixed point from {STARTS} random starts",
)  # fmt: skip


def uniqueness(count: int = 4000, seed: int = 6) -> PaperSection:
    """Exact points: where the iteration ends, and whether random starts end elsewhere."""
    scenes = {
        "the paper's object on its helix": _on(helix()),
        f"the same, turned by {FAR_DEG:g} degrees": _on(turned(helix(), FAR_DEG, seed)),
        **{
            f"random objects of {100 * size:g} % of their distance": random_problems(count, size, seed + i)
            for i, size in enumerate(SIZES)
        },
    }
    found = {name: ends(*scene, seed) for name, scene in scenes.items()}
    rows = tuple(
        (name, str(len(masks[0])), *(percent(wilson(mask), 2) for mask in masks)) for name, masks in found.items()
    )
    intro = (
        f"Four points without noise, all within {LIMIT_DEG:g} degrees of the axis for random objects. The iteration "
        "maps the third axis over the depth onto itself; where a bound on its slope is below one it contracts, and has "
        "one fixed point. Elsewhere it may have several, or pass the pose by, which repels it."
    )
    note = "As iterated, without the check by a triangle's poses that `solve` makes. 95 % intervals by Wilson."
    return PaperSection(
        "One solution", intro, (Table("Fixed points of EPOSIT", HEAD, rows, note),), (STATEMENT.judged(found),)
    )


def _on(pose: Pose) -> tuple[Orthography, Array]:
    x, y, z = np.moveaxis(pose.apply(OBJECT), -1, 0)
    return Orthography.of(OBJECT, np.stack((x / z, y / z)).transpose(0, 2, 1)), pose.R


def random_problems(count: int, size: float, seed: int) -> tuple[Orthography, Array]:
    """As many objects, one image each: their systems side by side, and the true rotations (count, 3, 3)."""
    rng = np.random.default_rng(seed)
    parts, rotations = list[Orthography](), list[Array]()
    while len(parts) < count:
        points = np.vstack((np.zeros(3), rng.standard_normal((3, 3))))
        points *= SIDE_MM / np.linalg.norm(points, axis=1).max()
        pose = at_angles(np.array([rng.uniform(0.0, LIMIT_DEG)]), SIDE_MM / size, rng)
        x, y, z = pose.apply(points)[0].T
        if np.linalg.cond(points[1:]) > CONDITION or np.any(np.hypot(x, y) > np.tan(np.deg2rad(LIMIT_DEG)) * z):
            continue
        parts.append(Orthography.of(points, np.stack((x / z, y / z))[..., None]))
        rotations.append(pose.R[0])
    return Orthography.side_by_side(parts), np.stack(rotations)


def ends(system: Orthography, truth: Array, seed: int) -> tuple[Mask, ...]:
    """One fixed point proved; ends in the pose; elsewhere; does not end; another fixed point known: each (b,)."""
    rng, start = np.random.default_rng(seed), posit(system, 1e-10, STEPS)
    right = rotation_error_rad(start.R.transpose(2, 0, 1), truth) < EXACT_RAD
    single, doubled = system.contraction < 1.0, np.zeros(len(truth), bool)
    depth = np.sqrt(np.sum(system.rest[0] ** 2, axis=0))
    for _ in range(STARTS):
        k = rng.standard_normal((3, len(truth)))
        other = posit(system, 1e-10, STEPS, k * depth / np.sqrt(np.sum(k * k, axis=0)))
        apart = rotation_error_rad(other.R.transpose(2, 0, 1), start.R.transpose(2, 0, 1)) > 1e-3
        doubled |= apart & other.converged & start.converged
    return single, start.converged & right, start.converged & ~right, ~start.converged, doubled


def _ends_text(found: dict[str, tuple[Mask, ...]]) -> str:
    near, *_, large = found.values()
    return (
        f"on the helix one fixed point in {percent(wilson(near[0]), 0)}; of random objects of {100 * SIZES[-1]:g} % of "
        f"their distance {percent(wilson(large[1]), 2)} end in the pose, {percent(wilson(large[2]), 2)} elsewhere, and "
        f"{percent(wilson(large[4]), 2)} have another fixed point"
    )


def _always_the_pose(found: dict[str, tuple[Mask, ...]]) -> bool:
    return all(bool(np.all(masks[1])) and not np.any(masks[4]) for masks in found.values())


STATEMENT = Statement(
    "I", "The solution is unique, since it is found by iterating", "-", _ends_text, "the same iteration",
    holds_if(_always_the_pose, Verdict.PARTLY),
    "An iteration returns one answer, which does not make it the only one. Where the object is small and near the axis "
    "a bound on the slope proves one fixed point; large objects can have a second, or one that repels.", "beyond",
)  # fmt: skip

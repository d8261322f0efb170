"""One picture of a run made again, from the run's recipe and seed, and what this code finds in it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.errors import UserError, did_you_mean
from datasets.plan import plan
from eposit.arrays import Array
from pipelines.detection import detect_points
from pipelines.nightly import suites
from pipelines.nightly.history import History
from pipelines.stages.generate import picture, true_points

KINDS = (suites.PINNED, suites.FRESH, suites.CONFIRMING)


@dataclass(frozen=True, slots=True)
class Remade:
    """A picture with its truth."""

    camera: str
    image: NDArray[np.uint8]  # (height, width)
    error_px: Array  # (n, 2) found minus true, the circle last, NaN where nothing was found

    @property
    def told(self) -> str:
        """What was found, in one sentence."""
        corners, circle = self.error_px[:-1], self.error_px[-1]
        own = corners[np.isfinite(corners[:, 0])]
        if not len(own):
            return "no corner was found"
        (x, y), rms = np.mean(own, axis=0), float(np.sqrt(np.mean(own**2)))
        where = f"off by {circle[0]:+.4f}, {circle[1]:+.4f} px" if np.isfinite(circle[0]) else "not found"
        return (
            f"{len(own)} of {len(corners)} corners, mean error {x:+.5f}, {y:+.5f} px, RMS {rms:.5f} px; circle {where}"
        )


def remake(root: Path, run: str, suite: str, frame_id: int) -> Remade:
    """Make a picture of a run again and detect its points.

    suite: as the run's data name it, for example `fresh-typical`.

    Raises:
        UserError: no such run, suite or frame, or the recipe is gone.
    """
    row = History(root).run(run)
    known = {item["name"]: item["value"] for item in row["data"]}
    names = [name for name in known if name.partition("-")[0] in KINDS and "-" in name]
    if suite not in names:
        told = ", ".join(names) or "none"
        raise UserError(f"run {row['run_id']} has no suite {suite!r}{did_you_mean(suite, names)}; it has {told}")
    kind, _, regime = suite.partition("-")
    (made,) = suites.suites(kind, row["recipe"], [regime], suites.seed_of(kind, known))
    frames = plan(made.recipe)
    if not 0 <= frame_id < len(frames):
        raise UserError(f"suite {suite} has no frame {frame_id}; give a number from 0 to {len(frames) - 1}")
    frame = frames[frame_id]
    image = picture(made.recipe, frame)
    found = detect_points(image, made.recipe.target)
    return Remade(frame.camera.name, image, found.points_px - true_points(made.recipe, frame))

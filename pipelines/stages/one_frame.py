"""One picture of a recipe made again, from its seed, and what this code finds in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.errors import UserError
from datasets.plan import plan
from datasets.recipe.model import Recipe
from eposit.arrays import Array
from pipelines.detection import detect_points
from pipelines.stages.generate import picture, true_points


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


def remake(recipe: Recipe, frame_id: int, whose: str) -> Remade:
    """Make a picture of a recipe again and detect its points. whose: what has the frame, for the message.

    Raises:
        UserError: no such frame.
    """
    frames = plan(recipe)
    if not 0 <= frame_id < len(frames):
        raise UserError(f"{whose} has no frame {frame_id}; give a number from 0 to {len(frames) - 1}")
    frame = frames[frame_id]
    image = picture(recipe, frame)
    found = detect_points(image, recipe.target)
    return Remade(frame.camera.name, image, found.points_px - true_points(recipe, frame))

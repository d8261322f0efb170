"""The plain full-frame script at as many samples as it needs for our corner errors, against our frame."""

from __future__ import annotations

import functools
from collections.abc import Iterator

from datasets.plan import Frame
from datasets.recipe.model import Recipe
from pipelines.bench.cases import chosen_frames, corner_errors, linear_of, over_background, rms
from pipelines.bench.frame import frame_of_ours, plain
from pipelines.bench.table import Figure, Row, compared
from pipelines.timing import in_turn
from render.frame import LinearImage
from render.region import target_region

PART = "equal error"
SAMPLES = (64, 128, 256, 512, 1024, 2048)
POSES = 4


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """Corner error of the plain script by samples, and its time for a full picture at those that it needs.

    For the recipe's last camera; `poses` does not matter. The errors are taken from the region alone, which has the
    same pixels. Where 2048 samples do not suffice, they are timed: the ratio is then a lower bound.
    """
    frames = chosen_frames(recipe, POSES)[recipe.cameras[-1].name]
    ours = rms([corner_errors(recipe, frame, linear_of(recipe, frame)) for frame in frames])
    yield Figure(PART, f"{frames[0].camera.name}: corners, ours", f"{ours:.4f} px RMS")
    needed = SAMPLES[-1]
    for samples in SAMPLES:
        theirs = rms([corner_errors(recipe, frame, _plain_master(recipe, frame, samples)) for frame in frames])
        yield Figure(PART, f"corners, plain script, {samples} samples", f"{theirs:.4f} px RMS")
        if theirs <= ours:
            needed = samples
            break
    frame = frames[0]
    (own,) = in_turn(functools.partial(frame_of_ours, recipe, frame))
    (that,) = in_turn(functools.partial(plain, recipe, frame, needed), repeats=1, warm_up=False)
    yield compared(PART, "frame and detection", own, f"full picture, Mitsuba direct, {needed} rays", that)


def _plain_master(recipe: Recipe, frame: Frame, samples: int) -> LinearImage:
    camera = frame.camera.true_camera()
    region = target_region(recipe.target, camera, frame.cam_from_obj)
    return over_background(recipe, camera, plain(recipe, frame, samples, region), region)

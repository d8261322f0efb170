"""Figures of another machine, for recipes of which nothing was measured on this one: right within a factor of three.

They are of two cores of an Intel Xeon server (2026-11-26), from `plan --measure` on recipes demo, charuco, room and
demo-room, and grow with the pixels of a picture.
"""

from __future__ import annotations

from datasets.recipe.model import Recipe
from pipelines.cost.figures import Figures
from render.targets.chessboard import Chessboard

SOURCE = "figures of another machine, right within a factor of three; `plan {} --measure` takes this one's"
FRAME_S = {"generate": 0.03, "detect": 0.03, "estimate": 0.02, "score": 0.015}  # of any frame
PIXEL_S = {"generate": 0.02e-6, "detect": 0.018e-6, "estimate": 0.0, "score": 0.0}  # and of each of its pixels
SAMPLE_S = 0.2e-6  # of each path that is traced through a pixel
HYBRID_SAMPLE_S = 0.3e-6  # of each that is traced for what the closed form lacks, and of the closed form's layers
CLEAN_BYTES, NOISY_BYTES = 0.025, 0.7  # of a pixel in a PNG: pictures without noise are nearly even
REGION_BYTES, WHOLE_BYTES = 0.25, 0.9  # of a pixel in an EXR of the target's region alone, and in one of the whole
TRUTH_BYTES = 0.8  # of a pixel in a frame's truth
POINT_BYTES = {"keypoints": 36.0, "detections": 41.0}  # of each of the target's points
ESTIMATE_BYTES = {"estimates": 1500.0, "scores": 1500.0}
FILE_BYTES, WORKER_MB = 4_400.0, 550.0  # of a shard's file beside its rows; of a process
SHARD_FILES = {True: 13, False: 7}  # of a chessboard with its circle, five kinds of estimates, and of a flat target


def reference_figures(recipe: Recipe) -> Figures:
    """What a frame of the recipe may take."""
    pixels = sum(camera.width * camera.height for camera in recipe.cameras) / len(recipe.cameras)
    seconds = {stage: FRAME_S[stage] + pixels * PIXEL_S[stage] for stage in FRAME_S}
    seconds["generate"] += pixels * _traced_s(recipe)
    files = SHARD_FILES[isinstance(recipe.target, Chessboard)]
    source = SOURCE.format(recipe.name)
    return Figures(seconds, _frame_bytes(recipe, pixels), files * FILE_BYTES, files, WORKER_MB, source)


def _traced_s(recipe: Recipe) -> float:
    """Processor time of the rays of a pixel, s."""
    world = recipe.world
    if world.method == "path":
        return SAMPLE_S * (world.path_samples + world.background_samples)
    return HYBRID_SAMPLE_S * (world.background_samples + world.layer_samples) if world.method == "hybrid" else 0.0


def _frame_bytes(recipe: Recipe, pixels: float) -> dict[str, float]:
    channels = 3 if recipe.outputs.colour else 1
    has_noise = recipe.sensor.full_well_e > 0.0 or recipe.sensor.read_noise_e > 0.0
    linear = REGION_BYTES if recipe.world.method == "closed" else WHOLE_BYTES
    points = len(recipe.target.points)
    return {
        "frames": channels * pixels * (NOISY_BYTES if has_noise else CLEAN_BYTES),
        **{table: points * each for table, each in POINT_BYTES.items()},
        **ESTIMATE_BYTES,
        "masters": channels * pixels * linear,
        "truth": pixels * TRUTH_BYTES if recipe.outputs.aovs else 0.0,
    }

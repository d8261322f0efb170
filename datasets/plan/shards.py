"""How a recipe's frames are cut into shards."""

from __future__ import annotations

import functools

from datasets.plan.frame import Frame
from datasets.plan.frames import frame_count, frames_by_number
from datasets.recipe.model import Recipe

SHARDS = 16  # of a recipe that does not say how many frames a shard has
LEAST_SHARD_FRAMES, MOST_SHARD_FRAMES = 10, 1000
SHARD_PIXELS = 400_000_000  # most that a shard's pictures have: a worker holds them, with noise .7 bytes each


def shard_frames(recipe: Recipe) -> int:
    """Frames in one shard, but for the last: the recipe's `shard_frames`, or a sixteenth of all within limits.

    The boundaries come from the recipe alone, so that every machine cuts alike. Readers and disks like few large files,
    workers need shards to share: a sixteenth gives work to sixteen of them, and ten frames are enough for a file. The
    most are a thousand, or as many as have 400 million pixels (two hundred of two megapixels): that bounds what a
    worker holds in memory, some 0.3 GB, and what it loses when it is killed.
    """
    return shard_size(recipe, frame_count(recipe)) if recipe.shard_frames is None else recipe.shard_frames


def shard_size(recipe: Recipe, frames: int) -> int:
    """As `shard_frames`, if the recipe had so many frames."""
    if recipe.shard_frames is not None:
        return recipe.shard_frames
    wanted = max(LEAST_SHARD_FRAMES, -(-frames // SHARDS))
    return min(wanted, recipe.most_shard_frames or _most(recipe))


def _most(recipe: Recipe) -> int:
    pixels = sum(camera.width * camera.height for camera in recipe.cameras) / len(recipe.cameras)
    return min(MOST_SHARD_FRAMES, max(LEAST_SHARD_FRAMES, int(SHARD_PIXELS / pixels)))


def shard_count(recipe: Recipe) -> int:
    """Number of shards."""
    return -(-frame_count(recipe) // shard_frames(recipe))


def frame_ids_of_shard(recipe: Recipe, index: int) -> range:
    """The numbers of a shard's frames."""
    size = shard_frames(recipe)
    return range(index * size, min((index + 1) * size, frame_count(recipe)))


def frames_of_shard(recipe: Recipe, index: int) -> tuple[Frame, ...]:
    """The frames of one shard, in order.

    Raises:
        UserError: one cannot be made, as `datasets.plan.Plan` says.
    """
    chosen = frame_ids_of_shard(recipe, index)
    return _frames(recipe, chosen.start, chosen.stop)


@functools.lru_cache(maxsize=2)  # whoever reads several tables of a shard holds each against the same frames
def _frames(recipe: Recipe, start: int, stop: int) -> tuple[Frame, ...]:
    return frames_by_number(recipe)[start:stop]

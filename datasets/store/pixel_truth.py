"""Truth for every pixel on disk, as layers of an OpenEXR file."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.recipe.outputs import Layer
from datasets.store.exr_file import write_exr
from render.truth.pixels import PixelTruth

TRUTH = "truth"  # the folder
OBJECTS_KEY = "objects"  # in the header: names of the objects as JSON, the first has id 1


def truth_path(frame_id: int) -> str:
    """Path of a frame's truth in its dataset's folder."""
    return f"{TRUTH}/{frame_id:06d}.exr"


def write_truth(truth: PixelTruth, layers: Iterable[Layer], path: Path) -> None:
    """Write some layers: `depth.Z` and `range.Z`, mm; `normal.X` to `normal.Z`; `object_id`, 32 bits; atomic."""
    channels: dict[str, NDArray[np.float32] | NDArray[np.uint32]] = {}
    for layer in layers:
        channels |= _channels(truth, layer)
    write_exr(path, {OBJECTS_KEY: json.dumps(truth.names)}, channels)


def _channels(truth: PixelTruth, layer: Layer) -> dict[str, NDArray[np.float32] | NDArray[np.uint32]]:
    if layer == "normal":
        return {f"normal.{axis}": np.ascontiguousarray(truth.normal[..., i]) for i, axis in enumerate("XYZ")}
    if layer == "object_id":
        return {"object_id": truth.object_id}
    return {f"{layer}.Z": truth.depth_mm if layer == "depth" else truth.range_mm}

"""Dr.Jit's kernels are compiled in the first frame of each lens only, whatever the poses draw."""

from __future__ import annotations

import pytest

from datasets.plan import plan
from datasets.recipe.model import parse_recipe
from pipelines.stages import generate
from render import backend

RECIPE = """
name = "kernels"
allow_cropped = true

[trajectory]
kind = "scatter"
count = 4
depth_range_mm = [900, 1800]
offset_range_mm = [0, 300]
tilt_range_deg = [0, 40]

[[cameras]]
name = "perspective"
lens = "perspective"
fx = 68.9
fy = 69.1
cx = 40.3
cy = 30.1
width = 80
height = 60

[[cameras]]
name = "equisolid"
lens = "equisolid"
fx = 27.6
fy = 27.7
cx = 39.1
cy = 30.6
width = 80
height = 60
"""
DRAWN = """
[world]
method = "path"
surround = "{}"
draw = "pose"
surface = "rough_plastic"
roughness_range = [0.1, 0.3]
clutter = [0, 7]
occluders = [0, 3]
boards = [0, 2]
absent_share = 0.4
path_samples = 2
background_samples = 2

[outputs]
aovs = ["range", "object_id"]
"""
HYBRID = """
[world]
method = "hybrid"
surround = "room"
surface = "rough_plastic"
clutter = [3, 3]
occluders = [1, 1]
path_samples = 2
background_samples = 1
bake_samples = 4
"""


@pytest.mark.full
@pytest.mark.parametrize(
    "world",
    ["", DRAWN.format("room"), DRAWN.format("sky"), HYBRID],
    ids=["closed", "room drawn for each pose", "sky drawn for each pose", "hybrid"],
)
def test_kernels_are_compiled_in_the_first_frame_of_each_lens(world):
    recipe = parse_recipe(RECIPE + world, "recipe")
    frames = plan(recipe)
    assert len({frame.world.has_target for frame in frames}) == (2 if "absent" in world else 1)
    found = {frame.frame_id: _kernels(recipe, frame) for frame in frames}
    first = {frame.frame_id for frame in frames if frame.pose_id == 0}
    known = set().union(*(found[i] for i in first))
    later = {i: len(kernels - known) for i, kernels in found.items() if i not in first}
    assert set(later.values()) == {0}, later
    # The kernels that trace the light are one for both lenses: the second lens has only small ones of its own.
    own = {size for size, _ in found[1] - found[0]}
    assert not own or max(own) < 1000, own


def _kernels(recipe, frame):
    """Sizes and hashes of the kernels that a frame and its truth take."""
    backend.load()
    dr = backend.jit()
    before = dr.flag(dr.JitFlag.KernelHistory)
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    try:
        dr.kernel_history_clear()
        generate._rendered(recipe, frame)
        generate._traced(recipe, frame)
        history = dr.kernel_history()
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, before)
    return {(entry["operation_count"], entry["hash"]) for entry in history if entry["type"] == dr.KernelType.JIT}

"""A frame is made from the recipe and its number alone, whatever the length of the plan."""

from __future__ import annotations

import dataclasses
import tracemalloc

import numpy as np
import pytest

from datasets.errors import UserError
from datasets.plan import frame_count, frame_ids_of_shard, frames_of_shard, plan, shard_count
from datasets.plan import frames as module
from datasets.recipe.model import load_recipe, parse_recipe
from tests.conftest import TINY

SCATTER = 'kind = "scatter"\ncount = {}\ndepth_range_mm = [2500, 3000]\noffset_range_mm = [0, 100]'
FIELD = 'kind = "field"\nfield_deg = [0, 3]\ndistance_mm = [2500, 2600]\nazimuth_deg = {}'
HELIX = "start = 0\nstop = 1e-3\nstep = {}"
HUGE = {"scatter": SCATTER.format(10**9), "field": FIELD.format(250_000_000), "helix": HELIX.format(1e-12)}


def recipe_of(trajectory, **replaced):
    text = TINY.replace("stop = 90\nstep = 90", trajectory)
    for old, new in replaced.items():
        text = text.replace(old, new)
    return parse_recipe(text, "test")


def told(frame):
    """A frame's values in a form that can be compared."""
    pose = frame.cam_from_obj
    numbers = frame.frame_id, frame.pose_id, frame.time_s, frame.render_seed, frame.sensor_seed
    return numbers, frame.camera.name, frame.sensor, frame.world, pose.R.tobytes(), pose.t.tobytes()


@pytest.mark.parametrize("name", ["wide", "demo", "clutter"])
def test_a_frame_alone_is_the_one_among_all(name):
    recipe = load_recipe(name)[0]
    frames = plan(recipe)
    one_by_one = [told(frame) for frame in frames]
    assert [told(frames[i]) for i in reversed(range(0, len(frames), 9))][::-1] == one_by_one[::9]
    assert told(frames[-1]) == one_by_one[-1]
    assert [told(frame) for frame in frames[3:7]] == one_by_one[3:7]
    with pytest.raises(IndexError):
        frames[len(frames)]


@pytest.mark.parametrize("kind", HUGE)
def test_a_plan_of_a_thousand_million_frames_holds_none_of_them(kind, monkeypatch):
    monkeypatch.setattr(module, "CHECKED_FRAMES", 10)
    recipe = recipe_of(HUGE[kind], **{"shard_frames = 1\n": ""})
    plan(recipe_of(HUGE[kind], **{"seed = 5": "seed = 6"}))  # what is made once for all plans
    tracemalloc.start()
    try:
        frames = plan(recipe)
        last = frames[len(frames) - 1]
        held = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(frames) == frame_count(recipe) >= 10**9
    assert last.frame_id == len(frames) - 1
    assert held < 2**20  # a list of as many numbers would take eight thousand times more
    shards = shard_count(recipe)
    assert frame_ids_of_shard(recipe, shards - 1)[-1] == last.frame_id


def test_poses_of_a_long_scatter_are_those_of_a_short_one(monkeypatch):
    monkeypatch.setattr(module, "CHECKED_FRAMES", 10)
    short, long = (plan(recipe_of(SCATTER.format(count))) for count in (3, 10**9))
    assert [told(frame) for frame in short] == [told(frame) for frame in long[:3]]


def test_a_fault_between_the_checked_frames_is_told_when_its_shard_is_made(monkeypatch):
    poses = ["{ centre_mm = [0, 0, 2500] }"] * 20
    poses[7] = "{ centre_mm = [0, 0, -2500] }"
    recipe = recipe_of(f'kind = "listed"\nposes = [{", ".join(poses)}]')
    with pytest.raises(UserError, match="frame 7 "):
        plan(recipe)
    monkeypatch.setattr(module, "CHECKED_FRAMES", 2)
    checked = recipe.model_copy(update={"seed": 6})
    assert len(plan(checked)) == 20
    assert len(frames_of_shard(checked, 6)) == 1
    with pytest.raises(UserError, match="frame 7 "):
        frames_of_shard(checked, 7)


def test_cameras_with_limits_are_counted_for_so_many_poses_only():
    limited = {"nominal_f": "max_field_deg = 50\nnominal_f"}
    with pytest.raises(UserError, match=r"1000000000 poses and cameras with max_field_deg.*at most 1000000"):
        plan(recipe_of(SCATTER.format(10**9), **limited))
    assert len(plan(recipe_of(SCATTER.format(3), **limited))) == 3


def test_the_poses_of_a_field_are_counted_through_in_order():
    path = recipe_of(FIELD.format(5)).trajectory
    assert path.count == 20
    places = np.array([path.pose(i, recipe_of(FIELD.format(5)).target).t for i in range(20)])
    turned = dataclasses.replace(path, azimuth_deg=(0.0, 72.0, 144.0, 216.0, 288.0))
    np.testing.assert_array_equal(places, [turned.pose(i, recipe_of(FIELD.format(5)).target).t for i in range(20)])

"""How a recipe's frames are cut into shards."""

from __future__ import annotations

import pytest

from datasets.plan import frames_of_shard, plan, shard_count, shard_frames
from datasets.plan import shards as module
from datasets.recipe.model import load_recipe, parse_recipe, recipe_names
from tests.conftest import TINY


@pytest.mark.parametrize(
    ("frames", "size"),
    [(1, 10), (10, 10), (160, 10), (161, 11), (3200, 200), (16000, 1000), (16001, 1000), (10**9, 1000)],
)
def test_a_recipe_that_does_not_say_has_sixteen_shards_of_10_to_1000_frames(frames, size, monkeypatch):
    recipe = parse_recipe(TINY.replace("shard_frames = 1\n", ""), "test")
    monkeypatch.setattr(module, "frame_count", lambda _: frames)
    assert shard_frames(recipe) == size
    assert shard_count(recipe) == -(-frames // size)
    assert shard_frames(parse_recipe(TINY, "test")) == 1


@pytest.mark.parametrize(("width", "height", "size"), [(1600, 1200, 208), (6000, 4000, 16), (10000, 10000, 10)])
def test_shards_of_large_pictures_have_fewer_frames(width, height, size, monkeypatch):
    text = (
        TINY.replace("shard_frames = 1\n", "").replace("400", str(width)).replace("height = 300", f"height = {height}")
    )
    monkeypatch.setattr(module, "frame_count", lambda _: 10**6)
    assert shard_frames(parse_recipe(text, "test")) == size


@pytest.mark.parametrize("name", recipe_names())
def test_a_recipe_that_comes_along_says_it_and_leaves_work_for_two(name):
    recipe = load_recipe(name)[0]
    assert recipe.shard_frames is not None
    assert shard_count(recipe) >= 2


@pytest.mark.parametrize("size", [1, 2, 3])
def test_shards_hold_every_frame_once(size):
    recipe = parse_recipe(TINY.replace("shard_frames = 1", f"shard_frames = {size}").replace("90", "30"), "test")
    found = [frame for index in range(shard_count(recipe)) for frame in frames_of_shard(recipe, index)]
    assert [frame.frame_id for frame in found] == list(range(len(plan(recipe))))
    assert [frame.sensor_seed for frame in found] == [frame.sensor_seed for frame in plan(recipe)]
    assert all(len(frames_of_shard(recipe, index)) == size for index in range(shard_count(recipe) - 1))

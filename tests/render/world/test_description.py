"""Worlds as values, and what is drawn of them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from render.world import World, draw_world

WRONG = {
    "closed shows the studio": ({"surround": "room"}, "method is 'closed'"),
    "closed is matt": ({"surface": "laminated"}, "method is 'closed'"),
    "closed has nothing around": ({"clutter": (0, 3)}, "method is 'closed'"),
    "baked once, drawn anew": ({"method": "hybrid", "draw": "pose"}, "baked once"),
    "absent in all frames": ({"method": "path", "absent_share": 0.2}, "set draw to pose"),
    "file without use": ({"method": "path", "surround": "room", "file": "a.exr"}, "which takes none"),
    "no file": ({"method": "path", "surround": "scene"}, "ends in .xml"),
    "other file": ({"method": "path", "surround": "envmap", "file": "a.png"}, "ends in .exr or .hdr"),
    "no hash": ({"method": "path", "surround": "envmap", "file": "a.exr", "file_sha256": "1"}, "64 hexadecimal digits"),
    "range turned around": ({"method": "path", "clutter": (3, 1)}, "least and the largest"),
    "too much": ({"method": "path", "occluders": (0, 99)}, "in 0 to 8"),
    "short paths": ({"method": "path", "path_depth": 1}, "must lie in 2 to 64"),
    "small room": ({"method": "path", "room_mm": (10.0, 5000.0, 5000.0)}, "each must lie in"),
    "above the ceiling": ({"method": "path", "surround": "room", "floor_mm": 9000.0}, "below its ceiling"),
    "no direction": ({"method": "path", "facing": (0.0, 0.0, 0.0)}, "not parallel"),
    "parallel": ({"method": "path", "facing": (0.0, 2.0, 0.0)}, "not parallel"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_world_that_cannot_be_is_refused(name):
    values, words = WRONG[name]
    with pytest.raises(ValueError, match=words):
        World(**values)


WORLD = World(
    method="path",
    draw="pose",
    clutter=(2, 9),
    occluders=(0, 2),
    absent_share=0.25,
    roughness_range=(0.1, 0.3),
    lamp_power_range=(0.5, 2.0),
    exposure_range=(0.8, 1.2),
)


def test_draws_lie_in_their_ranges_and_reach_both_ends():
    draws = [draw_world(WORLD, np.random.default_rng(i)) for i in range(300)]
    assert {draw.clutter for draw in draws} == set(range(2, 10))
    assert {draw.occluders for draw in draws} == {0, 1, 2}
    assert all(0.1 <= draw.roughness <= 0.3 and 0.8 <= draw.exposure <= 1.2 for draw in draws)
    assert {draw.sun_elevation_deg for draw in draws} == {40.0}  # a range of one value
    # 300 draws at 25 %: five standard deviations of their share are 12.5 %.
    assert abs(np.mean([draw.has_target for draw in draws]) - 0.75) < 0.125
    assert len({draw.layout_seed for draw in draws}) == 300


def test_a_range_does_not_move_the_other_draws():
    wider = dataclasses.replace(WORLD, clutter=(0, 50))
    one, other = (draw_world(world, np.random.default_rng(3)) for world in (WORLD, wider))
    assert dataclasses.replace(other, clutter=one.clutter) == one

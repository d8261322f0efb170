"""Hybrid pictures: against the closed form, against path tracing, and their bits."""

import numpy as np
import pytest

from eposit import Camera, Pose
from eposit.pose import rotation_from_euler
from render import backend
from render.frame import render_frame, render_world
from render.hybrid.prepare import baked_light, hybrid_scene
from render.light import Light
from render.pathtraced.tiles import Viewpoint
from render.region import target_region
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region
from render.world import World, draw_world

TARGET, LIGHT = Chessboard(columns=5, rows=4), Light()  # small: its bake is quick
CAMERA = Camera(lens="equisolid", fx=70.0, fy=70.2, cx=80.3, cy=58.9, width=160, height=120)
CELLS, SEED = 64, 11


def pose(tilt=25.0, depth=800.0):
    R = rotation_from_euler(np.deg2rad([tilt, -0.6 * tilt, 9.0]))
    return Pose(R, np.array([30.0, -20.0, depth]) - R @ TARGET.board_centre)


def scene_of(bake_samples=8, **keys):
    world = World(method="hybrid", bake_samples=bake_samples, **keys)
    draw = draw_world(world, np.random.default_rng(4))
    return hybrid_scene(world, draw, TARGET, LIGHT, baked_light(world, draw, TARGET, LIGHT))


@pytest.fixture(scope="module")
def room():
    return scene_of(surround="room", surface="rough_plastic", occluders=(1, 1), clutter=(3, 3), path_samples=4)


@pytest.mark.full
def test_in_the_studio_a_matt_board_is_that_of_the_closed_form():
    near = target_region(TARGET, CAMERA, pose())
    ours = scene_of(bake_samples=64, path_depth=2).region(CAMERA, pose(), near, cells=CELLS, seed=SEED)
    closed = render_frame(TARGET, LIGHT, CAMERA, pose(), samples=CELLS).radiance
    grey = 204.0 * (ours.mean(axis=2) - closed)
    # 64 rays a texel leave a per cent in the average of some texels, and more around the circle.
    assert abs(grey.mean()) < 0.3
    assert np.sqrt(np.mean(grey**2)) < 2.0
    assert np.quantile(np.abs(grey), 0.99) < 7.0


@pytest.mark.full
def test_a_region_has_the_bits_of_the_whole_picture(room):
    near = target_region(TARGET, CAMERA, pose())
    part = room.region(CAMERA, pose(), near, cells=CELLS, seed=SEED)
    whole = room.region(CAMERA, pose(), Region.whole(CAMERA.width, CAMERA.height), cells=CELLS, seed=SEED)
    np.testing.assert_array_equal(part, whole[near.pixels])
    around = room.surroundings(CAMERA, pose(), near, seed=SEED)
    outside = np.ones(around.shape[:2], bool)
    outside[near.pixels] = False
    np.testing.assert_array_equal(around[outside], whole[outside])
    assert not np.array_equal(part, room.region(CAMERA, pose(), near, cells=CELLS, seed=SEED + 1))


@pytest.mark.full
def test_threads_change_no_bit(room):
    dr = backend.jit()
    near, count = target_region(TARGET, CAMERA, pose()), dr.thread_count()
    first = room.region(CAMERA, pose(), near, cells=CELLS, seed=SEED)
    try:
        for threads in (1, 3):
            dr.set_thread_count(threads)
            np.testing.assert_array_equal(room.region(CAMERA, pose(), near, cells=CELLS, seed=SEED), first)
    finally:
        dr.set_thread_count(count)


@pytest.mark.full
def test_a_new_pose_region_or_camera_compiles_nothing(room):
    dr = backend.jit()

    def kernels(camera, where):
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            room.region(camera, where, target_region(TARGET, camera, where), cells=CELLS, seed=SEED)
            return {kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel}

    first = kernels(CAMERA, pose())
    assert len(first) > 5
    assert kernels(CAMERA, pose(40.0, 1100.0)) <= first
    assert kernels(CAMERA.replace(fx=60.0, cx=70.0, width=150), pose(20.0)) <= first


@pytest.mark.full
def test_occluders_are_path_traced_with_a_margin(room):
    """Before the target stands a thing: a picture without it differs there, and only there but for its shade."""
    near = target_region(TARGET, CAMERA, pose())
    layers = room.closed.layers(CAMERA, pose(), near, CELLS)
    rays = room.frame(CAMERA, pose(), SEED)
    hidden = rays.hidden(near, layers.filled > 0.0)
    assert 10 < hidden.sum() < 0.5 * hidden.size
    picture = room.region(CAMERA, pose(), near, cells=CELLS, seed=SEED)
    traced = rays.front(near, hidden) * room.gain
    np.testing.assert_array_equal(picture[hidden], traced[hidden])


@pytest.mark.full
@pytest.mark.parametrize("surface", ["matt", "laminated"])
def test_a_picture_is_that_of_the_path_tracer_on_the_mean(surface):
    """In grey levels of a board whose white is 204.

    The mean of so many rays is known within 0.1 levels; a bake of 8 rays for a texel moves the whole board by one.
    """
    keys = {"surround": "sky", "surface": surface, "path_samples": 256, "background_samples": 64}
    hybrid = World(method="hybrid", bake_samples=256, layer_samples=16, **keys)
    path = World(method="path", **keys)
    draw, view = draw_world(hybrid, np.random.default_rng(4)), Viewpoint(CAMERA, pose(), SEED)
    ours, theirs = (
        render_world(world, draw, TARGET, LIGHT, view, samples=CELLS, in_colour=True).radiance
        for world in (hybrid, path)
    )
    assert not np.isnan(ours).any()
    difference = 204.0 * (ours - theirs).mean(axis=2)
    assert abs(difference.mean()) < 0.3
    assert abs(np.median(difference)) < 0.5

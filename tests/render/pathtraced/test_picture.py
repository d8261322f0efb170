"""Path-traced pictures of worlds: bits, kernels, light against closed forms."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from eposit import Camera, Pose
from eposit.pose import rotation_from_euler
from render import backend
from render.frame import render_frame, render_world
from render.light import Light
from render.pathtraced.picture import prepared, trace_picture
from render.pathtraced.tiles import TILE, Tracer, Viewpoint, tile_seed, tiles_of, trace_region
from render.region import target_region
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region
from render.world import World, draw_world
from render.world.boards import target_shapes
from render.world.compose import Composition, load_objects
from render.world.materials import surface

TARGET, LIGHT = Chessboard(), Light()
CAMERA = Camera(lens="equisolid", fx=60.0, fy=60.2, cx=80.3, cy=69.2, width=160, height=140)
STUDIO = World(method="path", path_samples=4, background_samples=1)
ROOM = dataclasses.replace(STUDIO, surround="room", clutter=(3, 3), occluders=(1, 1), surface="rough_plastic")


def view(tilt=20.0, depth=1500.0, camera=CAMERA, seed=5):
    R = rotation_from_euler(np.deg2rad([tilt, 0.5 * tilt, 12.0]))
    return Viewpoint(camera, Pose(R, np.array([20.0, -10.0, depth]) - R @ TARGET.board_centre), seed)


def drawn(world, seed=0):
    return draw_world(world, np.random.default_rng(seed))


def picture(world, where, in_colour=True, draw=None):
    return render_world(world, draw or drawn(world), TARGET, LIGHT, where, samples=16, in_colour=in_colour)


def test_a_region_has_the_bits_of_the_whole_picture():
    where = view()
    near = target_region(TARGET, where.camera, where.cam_from_obj)
    part = Region(70, 60, 75, 75)  # in four tiles, which reach beyond it
    assert len(list(tiles_of(part))) == 4
    films = [
        trace_picture(STUDIO, drawn(STUDIO), TARGET, LIGHT, where, near, region)
        for region in (part, Region.whole(CAMERA.width, CAMERA.height))
    ]
    np.testing.assert_array_equal(films[0], films[1][part.pixels])
    assert films[0][..., 0].std() > 0.1  # the board is in it


def test_threads_do_not_change_the_bits():
    backend.load()
    dr = backend.jit()
    before, films = dr.thread_count(), []
    try:
        for threads in (1, 2, 3):
            dr.set_thread_count(threads)
            films.append(picture(ROOM, view()).full(CAMERA))
    finally:
        dr.set_thread_count(before)
    np.testing.assert_array_equal(films[0], films[1])
    np.testing.assert_array_equal(films[0], films[2])


def test_every_tile_of_every_frame_has_its_own_seed():
    seeds = {tile_seed(frame, tile) for frame in range(20) for tile in tiles_of(Region.whole(10 * TILE, 10 * TILE))}
    assert len(seeds) == 2000


def test_kernels_are_compiled_in_the_first_frame_only():
    backend.load()
    dr = backend.jit()

    def kernels(where):
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            picture(ROOM, where)
            return {kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel}

    prepared.cache_clear()
    first = kernels(view())
    assert len(first) > 3
    assert kernels(view(40.0, 1900.0, seed=6)) <= first
    other = CAMERA.replace(fx=70.0, cx=60.0, width=300, height=90)  # more tiles, of which some are off the board
    assert kernels(view(10.0, camera=other)) <= first


def test_grey_is_the_luminance_of_colour():
    grey, colour = picture(ROOM, view(), in_colour=False), picture(ROOM, view())
    np.testing.assert_allclose(grey.background, colour.background @ [0.2126, 0.7152, 0.0722], rtol=1e-5, atol=1e-6)
    assert np.abs(colour.background[..., 0] - colour.background[..., 2]).max() > 0.1
    np.testing.assert_array_equal(grey.full(CAMERA)[grey.region.pixels], grey.radiance)


def test_a_matt_board_in_a_room_has_the_brightness_of_the_metered_card():
    world = dataclasses.replace(ROOM, surface="matt", occluders=(0, 0), path_samples=16)
    found = picture(world, view(0.0), in_colour=False)
    white = np.quantile(found.radiance, 0.9)  # a third of the board is white, and no wall is as bright
    assert white == pytest.approx(1.0, abs=0.1)  # light falls unevenly over the board, and 16 rays leave 5 %


@pytest.mark.parametrize("lens", ["perspective", "equisolid", "orthogonal"])
def test_the_studio_is_that_of_the_closed_form(lens):
    """White, black, edges and shade: the mean of each within four standard errors of it."""
    camera = CAMERA.replace(lens=lens, fx=90.0, fy=90.2)
    where = view(camera=camera)
    world = dataclasses.replace(STUDIO, path_samples=64, path_depth=2)
    traced = picture(world, where, in_colour=False)
    exact = render_frame(TARGET, LIGHT, camera, where.cam_from_obj, samples=1024)
    assert traced.region == exact.region
    difference = 255.0 * (traced.radiance - exact.radiance)
    classes = {
        "white": exact.radiance > 0.85,
        "black": exact.radiance < 0.08,
        "edges": (exact.radiance > 0.15) & (exact.radiance < 0.75),
    }
    for name, chosen in classes.items():
        part = difference[chosen]
        assert len(part) > 50, name
        assert abs(part.mean()) < 4.0 * part.std() / len(part) ** 0.5, name
        assert abs(part.mean()) < 0.5, name  # grey levels; a wrong lamp or lens shows as several


@pytest.mark.parametrize("lens", ["perspective", "stereographic", "equidistance", "equisolid", "orthogonal"])
def test_white_furnace(lens):
    """A board and disc that reflect everything, under even light of radiance 1, cannot be seen."""
    board = dataclasses.replace(TARGET, white=1.0, black=1.0, circle=1.0)
    mi = backend.load()
    shapes = target_shapes(board, lambda reflectance: surface("matt", 0.0, reflectance))
    scene = load_objects({**shapes, "light": {"type": "constant", "radiance": {"type": "uniform", "value": 1.0}}})
    integrator = mi.load_dict({"type": "path", "max_depth": 64, "rr_depth": 64})
    tracer = Tracer(scene, integrator, Composition({}, np.eye(4), shows_emitters=True))
    where = view(depth=700.0, camera=CAMERA.replace(lens=lens, width=120, height=120, cx=60.0, cy=60.0))
    film = trace_region(tracer, dataclasses.replace(where, seed=1), Region.whole(120, 120), lambda _: 16)
    radius = np.hypot(*np.meshgrid(np.arange(120) - 60.0, np.arange(120) - 60.0)) / 60.3
    inside = film[radius < min(where.camera.law.rho_max, 1e3) - 0.05][:, :3]
    difference = inside[:, 0] - 1.0
    assert difference.std() < 0.05  # a pixel that took or lost light would be an outlier
    # Between board and disc paths are reflected on; those of more than 64 reflections are lost, less than 1e-3 of them.
    assert abs(difference.mean()) < 2.0 * difference.std() / len(difference) ** 0.5 + 1e-4

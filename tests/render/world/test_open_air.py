"""Where the sun stands."""

import numpy as np
import pytest

from render import backend
from render.light import Light
from render.targets.chessboard import Chessboard
from render.world import World, draw_world
from render.world.compose import load_scene
from render.world.open_air import sun_direction


@pytest.mark.parametrize(("elevation", "turn"), [(50.0, 0.0), (20.0, 70.0), (35.0, -120.0)])
def test_the_sun_shines_from_its_height_and_side(elevation, turn):
    world = World(
        method="path",
        surround="sky",
        sun_elevation_range_deg=(elevation, elevation),
        rotation_range_deg=(turn, turn),
    )
    draw = draw_world(world, np.random.default_rng(1))
    scene, _ = load_scene(world, draw, Chessboard(), Light())
    mi = backend.load()
    # The object frame has x right and y down, and the camera stands at z < 0: at turn 0 the sun is behind it.
    up, right = np.sin(np.deg2rad(elevation)), np.sin(np.deg2rad(turn)) * np.cos(np.deg2rad(elevation))
    expected = np.array([right, -up, -np.cos(np.deg2rad(elevation)) * np.cos(np.deg2rad(turn))])
    np.testing.assert_allclose(sun_direction(draw), expected, atol=1e-12)
    mirrored = [expected * sign for sign in ((1, 1, 1), (-1, 1, 1), (1, 1, -1), (-1, 1, -1))]
    surface = backend.jit().zeros(mi.SurfaceInteraction3f, len(mirrored))
    surface.wi = mi.Vector3f(*(backend.upload(-part) for part in np.array(mirrored).T))
    radiance = np.array(scene.environment().eval(surface)).max(axis=0)
    assert radiance[0] > 100.0 * max(light for light, at in zip(radiance[1:], mirrored[1:], strict=True)
                                     if not np.allclose(at, expected))  # fmt: skip

"""Light from a white surroundings, where the answer is known."""

import numpy as np
import pytest

from render import backend
from render.hybrid.coat import WHITE, coat
from render.hybrid.keyed_sampler import keyed_sampler, lattice_numbers
from render.hybrid.outgoing import NUMBERS, direct_light, rest_of_light
from render.hybrid.placement import Placement
from render.world.materials import surface

RAYS = 1 << 15


def outgoing(material, tilt_deg=30.0, matrix=None):
    """Mean radiance of a point under an even sky of radiance 1, with nothing else in the scene."""
    mi, dr = backend.load(), backend.jit()
    scene = mi.load_dict({"type": "scene", "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}}})
    path = mi.load_dict({"type": "path", "max_depth": 3})
    lane, seed = dr.arange(mi.UInt32, RAYS), dr.opaque(mi.UInt32, 3)
    numbers = lattice_numbers(dr.zeros(mi.UInt32, RAYS), lane, seed, NUMBERS)
    tilt = np.deg2rad(tilt_deg)
    toward = mi.Vector3f(float(np.sin(tilt)), 0.0, float(-np.cos(tilt)))
    place = mi.Vector3f(dr.zeros(mi.Float, RAYS), 0.0, 0.0)
    points = Placement(np.eye(4) if matrix is None else matrix).surface(place, mi.Vector3f(0.0, 0.0, -1.0), toward)
    light = direct_light(scene, points, material, numbers)
    light += rest_of_light(scene, path, points, material, numbers, keyed_sampler(lane, lane, seed))
    return np.array(light).mean(axis=1)


def test_a_white_sheet_in_a_white_world_cannot_be_seen():
    np.testing.assert_allclose(outgoing(coat(surface("matt", 0.0, WHITE)).paint), 1.0, atol=0.003)
    turned = np.array([[0.0, 0.01, 0.0, 5.0], [0.0, 0.0, 0.01, -3.0], [0.01, 0.0, 0.0, 2.0], [0.0, 0.0, 0.0, 1.0]])
    np.testing.assert_allclose(outgoing(coat(surface("matt", 0.0, WHITE)).paint, matrix=turned), 1.0, atol=0.003)


@pytest.mark.parametrize(("kind", "roughness"), [("rough_plastic", 0.15), ("laminated", 0.0)])
@pytest.mark.parametrize("tilt_deg", [pytest.param(0.0, marks=pytest.mark.full), 60.0])
def test_paint_and_gloss_add_up_to_the_whole_surface(kind, roughness, tilt_deg):
    material = surface(kind, roughness, WHITE)
    parts = coat(material)
    paint, gloss = outgoing(parts.paint, tilt_deg), outgoing(parts.gloss, tilt_deg)
    whole = outgoing(backend.load().load_dict(material), tilt_deg)
    np.testing.assert_allclose(paint + gloss, whole, atol=0.01)
    assert 0.03 < gloss.mean() < 0.12  # 4 % along the normal of glass, 9 % at 60 degrees
    # The paint's light at an angle follows from that along the normal.
    along = outgoing(parts.paint, 0.0)
    share = np.interp(np.cos(np.deg2rad(tilt_deg)), np.linspace(0.0, 1.0, len(parts.transmission)), parts.transmission)
    np.testing.assert_allclose(paint, along * share, atol=0.01)

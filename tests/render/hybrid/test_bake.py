"""The baked light against the studio's closed form, which has no light from surface to surface."""

import numpy as np
import pytest

from render.hybrid.prepare import baked_light
from render.hybrid.texels import disc_grid
from render.light import Light, shading_map
from render.targets.chessboard import Chessboard
from render.world import World, draw_world

TARGET, LIGHT = Chessboard(columns=5, rows=4), Light()  # small: its bake is quick


def baked(surface):
    world = World(method="hybrid", path_depth=2, bake_samples=64, surface=surface)
    return baked_light(world, draw_world(world, np.random.default_rng(1)), TARGET, LIGHT)


@pytest.fixture(scope="module")
def studio():
    return baked("matt")


def test_the_studios_light_is_that_of_the_closed_form(studio):
    expected, disc = shading_map(TARGET, LIGHT)
    found = studio.board.mean(axis=2)
    error = found / expected - 1.0
    assert error.std() < 0.01
    assert abs(error.mean()) < 0.001
    np.testing.assert_allclose(studio.disc, disc, rtol=0.005)


def test_the_circle_is_matt_on_a_laminated_board(studio):
    """A laminate changes what the paint below it gets from each direction; the circle has none, and gets the same."""
    np.testing.assert_allclose(baked("laminated").disc, studio.disc, rtol=1e-6)


def test_nothing_is_darker_around_the_circle(studio):
    """An average that is too wide would spread the shade under the disc to where it is seen."""
    expected, _ = shading_map(TARGET, LIGHT)
    grid, place = disc_grid(TARGET)
    x, y = grid.places().T
    distance = np.hypot(x - TARGET.circle_centre[0], y - TARGET.circle_centre[1]).reshape(grid.rows, grid.columns)
    error = (studio.board.mean(axis=2) / expected - 1.0)[place]
    for low in (30.0, 35.0, 40.0, 50.0):
        ring = (distance >= low) & (distance < low + 5.0)
        assert abs(error[ring].mean()) < 0.006


def test_shadows_edges_are_marked(studio):
    rows, columns = np.nonzero(studio.edges > 0.0)
    _, (near_rows, near_columns) = disc_grid(TARGET)
    assert len(rows) == 0 or (
        rows.min() >= near_rows.start - 10
        and columns.min() >= near_columns.start - 10
        and rows.max() < near_rows.stop + 10
        and columns.max() < near_columns.stop + 10
    )  # the disc's shadow is the studio's only one

import numpy as np

from render.hybrid.texels import FEATHER, coarse_grid, disc_grid, fine_grid, magnified, paste
from render.light import Light, shading_map
from render.targets.chessboard import Chessboard

TARGET = Chessboard()


def test_the_fine_grid_is_that_of_the_map_of_the_light():
    shading, _ = shading_map(TARGET, Light())
    grid = fine_grid(TARGET)
    assert (grid.rows, grid.columns) == shading.shape


def test_the_coarse_grid_does_not_grow_with_the_board():
    small, large = coarse_grid(TARGET), coarse_grid(Chessboard(columns=24, rows=23))
    assert (small.columns, small.rows) == (240, 180)
    assert large.columns * large.rows <= 43500


def test_light_that_rises_evenly_is_magnified_exactly():
    coarse, fine = coarse_grid(TARGET), fine_grid(TARGET)
    x, y = coarse.places().T
    found = magnified((2.0 * x + 3.0 * y).reshape(coarse.rows, coarse.columns, 1), coarse, fine)[..., 0]
    x, y = fine.places().T
    expected = (2.0 * x + 3.0 * y).reshape(fine.rows, fine.columns)
    np.testing.assert_allclose(found[5:-5, 5:-5], expected[5:-5, 5:-5], atol=1e-9)
    assert np.abs(found - expected).max() < 5.0 * coarse.step[0]  # clamped beyond the outermost centres


def test_a_patch_lies_on_the_texels_of_the_fine_grid():
    fine, (near, place) = fine_grid(TARGET), disc_grid(TARGET)
    points = fine.places().reshape(fine.rows, fine.columns, 2)[place]
    np.testing.assert_allclose(near.places().reshape(points.shape), points, atol=1e-9)
    middle = near.places().mean(axis=0)
    assert np.hypot(*(middle - TARGET.circle_centre[:2])) < 1.0


def test_a_patch_takes_over_step_by_step():
    values = np.zeros((60, 60, 3))
    paste(values, np.ones((40, 40, 3)), (slice(10, 50), slice(10, 50)))
    row = values[30, :, 0]
    assert np.all(np.diff(row[:30]) >= 0.0)
    assert row[9] == 0.0
    assert row[10] == 1.0 / FEATHER
    assert row[10 + FEATHER - 1] == 1.0

"""A grid among discs: laid onto their lattice however it is tilted, refused where others would do as well."""

import numpy as np
import pytest

from pipelines.detection import disc_lattice
from pipelines.detection.disc_lattice import find_grid
from render.targets.circle_grid import CircleGrid

ASYMMETRIC = CircleGrid()
SYMMETRIC = CircleGrid(columns=9, rows=6, asymmetric=False)
RNG = np.random.default_rng(0)


def seen(target, tilt_deg=(0.0, 0.0), roll_deg=0.0):
    """(n, 2) px of the discs' centres, from 900 px focal length and 1.5 m."""
    a, b, c = np.deg2rad([*tilt_deg, roll_deg])
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    flat = target.pattern_points - target.pattern_points.mean(axis=0)
    points = np.column_stack((flat, np.zeros(len(flat)))) @ (z @ x @ y).T + [0.0, 0.0, 1500.0]
    return 900.0 * points[:, :2] / points[:, 2:] + 600.0


def is_among(ways, expected):
    return any(np.allclose(way, expected) for way in ways)


@pytest.mark.parametrize("target", [ASYMMETRIC, SYMMETRIC, CircleGrid(columns=5, rows=8)])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (30.0, -20.0), (0.0, 65.0), (62.0, 10.0)])
def test_a_grid_is_found_from_every_side_in_its_order(target, tilt):
    """Tilted by 65 degrees, a lattice's shortest steps run along diagonals of the grid."""
    for roll in (0.0, 45.0, 100.0, 200.0):
        expected = seen(target, tilt, roll)
        ways = find_grid(RNG.permutation(expected), target)
        assert is_among(ways, expected)
        assert len(ways) == (1 if target.tells_orientation else 2)
        if not target.tells_orientation:
            assert is_among(ways, expected[::-1])


def test_a_square_grid_has_four_ways():
    target = CircleGrid(columns=5, rows=5, asymmetric=False)
    expected = seen(target).reshape(5, 5, 2)
    ways = find_grid(expected.reshape(-1, 2), target)
    assert len(ways) == 4
    assert all(is_among(ways, np.rot90(expected, k).reshape(-1, 2)) for k in range(4))


def test_a_grid_among_other_discs_is_found():
    points = seen(ASYMMETRIC, (20.0, 10.0), 30.0)
    around = RNG.uniform(0.0, 1200.0, (200, 2))
    far = np.linalg.norm(around[:, None] - points, axis=-1).min(axis=1) > 40.0
    assert is_among(find_grid(np.concatenate((points, around[far])), ASYMMETRIC), points)


def test_a_grid_that_lacks_a_disc_or_has_a_row_too_many_is_not_the_target():
    points = seen(SYMMETRIC)
    assert find_grid(np.delete(points, 20, axis=0), SYMMETRIC) == []
    assert find_grid(seen(CircleGrid(columns=9, rows=7, asymmetric=False)), SYMMETRIC) == []


def test_a_texture_of_discs_is_left_as_soon_as_it_is_larger_than_the_grid(monkeypatch):
    """Its lattice would be grown over the whole picture from each of many discs."""
    largest = 0

    def claimed(points, tree, expected, within, taken, original=disc_lattice._claimed):
        nonlocal largest
        found = original(points, tree, expected, within, taken)
        largest = max(largest, int(np.sum(taken)))
        return found

    monkeypatch.setattr(disc_lattice, "_claimed", claimed)
    y, x = np.mgrid[0:80, 0:80] * 12.0
    assert find_grid(np.stack((x.ravel(), y.ravel()), axis=1), SYMMETRIC) == []
    assert 2 * 54 < largest < 4 * 54

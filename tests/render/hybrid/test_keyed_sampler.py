import numpy as np

from render import backend
from render.hybrid.keyed_sampler import keyed_sampler, lattice_numbers


def numbers_of(pixels, rays=16, seed=5):
    """(pixels, rays, 5) the first random numbers: two of the lattice, three of the sampler."""
    mi, dr = backend.load(), backend.jit()
    pixel = mi.UInt32(np.repeat(pixels, rays).astype(np.uint32))
    ray = mi.UInt32(np.tile(np.arange(rays), len(pixels)).astype(np.uint32))
    key = dr.opaque(mi.UInt32, seed)
    sampler = keyed_sampler(pixel, ray, key)
    pair = sampler.next_2d()
    found = [*lattice_numbers(pixel, ray, key, 2), sampler.next_1d(), pair.x, pair.y]
    return np.stack([np.array(values) for values in found], axis=1).reshape(len(pixels), rays, 5)


def test_a_ray_has_its_numbers_whoever_else_is_in_flight():
    every = numbers_of(np.arange(1000))
    np.testing.assert_array_equal(numbers_of(np.array([700, 3, 998])), every[[700, 3, 998]])
    assert not np.array_equal(numbers_of(np.arange(3), seed=6), every[:3])


def test_numbers_are_even_and_neighbours_are_not_alike():
    found = numbers_of(np.arange(4096))
    assert found.min() >= 0.0
    assert found.max() < 1.0
    np.testing.assert_allclose(found.mean(axis=(0, 1)), 0.5, atol=0.006)  # 65536 numbers: 0.0011 if independent
    np.testing.assert_allclose(found.std(axis=(0, 1)), 12.0**-0.5, atol=0.006)
    for first, second in ((found[:-1], found[1:]), (found[:, :-1, 2:], found[:, 1:, 2:])):
        a, b = (part.reshape(-1, part.shape[-1]) for part in (first, second))
        for i in range(a.shape[1]):
            assert abs(np.corrcoef(a[:, i], b[:, i])[0, 1]) < 0.02  # 1 / sqrt(61440) = 0.004 if independent


def test_numbers_of_a_pixel_are_spread_evenly():
    lattice = numbers_of(np.arange(256), rays=64)[..., 0]
    # The mean of 64 random numbers is off by 0.036.
    assert np.abs(lattice.mean(axis=1) - 0.5).mean() < 0.012

import numpy as np

from render.hybrid.smooth import NARROW, noise, smoothed


def halves(truth, deviation, rng):
    """Two halves of the rays; their mean has the deviation."""
    return truth + 2.0**0.5 * deviation * rng.normal(size=(2, *truth.shape))


def smooth_light(rows=60, columns=80):
    y, x = np.mgrid[0:rows, 0:columns]
    return np.repeat((1.0 + 0.003 * x - 0.002 * y)[..., None], 3, axis=2)


def test_noise_of_smooth_light_is_averaged_away():
    truth = smooth_light()
    both = halves(truth, 0.02, np.random.default_rng(1))
    found = smoothed(both.mean(axis=0), noise(both)) - truth
    inner = found[12:-12, 12:-12]
    # A gaussian of 4 texels averages over 4 pi 16 = 201 of them: a fourteenth of the noise. A few texels keep more.
    assert inner.std() < 0.02 / 8.0
    assert np.abs(inner.mean()) < 0.001
    narrow = smoothed(both.mean(axis=0), noise(both), NARROW) - truth
    assert 0.02 / 5.0 < narrow.std() < 0.02 / 2.5  # 4 pi texels


def test_the_edge_of_a_shadow_stays():
    truth = smooth_light()
    truth[:, 40:] *= 0.5
    both = halves(truth, 0.02, np.random.default_rng(2))
    found = smoothed(both.mean(axis=0), noise(both)) - truth
    # Beside the edge a gaussian of one texel would be off by 0.15.
    assert np.abs(found[12:-12, 38:42]).max() < 0.1
    assert np.abs(found[12:-12, 38:42].mean()) < 0.005


def test_a_stray_bright_path_is_no_edge():
    truth = smooth_light()
    both = halves(truth, 0.01, np.random.default_rng(3))
    both[0, 30, 40] += 0.4
    found = smoothed(both.mean(axis=0), noise(both)) - truth
    assert np.abs(found[30, 40]).max() < 0.02


def test_noise_is_that_of_the_mean():
    both = halves(np.ones((100, 100, 3)), 0.05, np.random.default_rng(4))
    assert np.sqrt(noise(both)).mean() > 0.05 * 0.95
    assert np.sqrt(noise(both)).mean() < 0.05 * 1.05

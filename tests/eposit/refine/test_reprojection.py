"""The parts of the solver that are written out for speed, against plain NumPy: derivatives, systems of six, roots."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from eposit import Camera
from eposit.pose import rotation_from_vector
from eposit.refine import ldl6
from eposit.refine.reprojection import Observations, equations
from eposit.refine.weights import whitening
from tests.cameras import ALL_CAMERAS, random_object, random_pose


def scene(camera: Camera, count: int, n: int = 5, noise: float = 0.4, ratio: float = 0.1, points=None):
    """Object, poses R (b, 3, 3) and t (b, 3), and noisy image points (b, n, 2)."""
    rng = np.random.default_rng(21)
    points = random_object(rng, n) if points is None else points
    poses = [random_pose(rng, points, 60.0, ratio) for _ in range(count)]
    pixels = np.stack([camera.project(pose.apply(points)) for pose in poses])
    return (
        points,
        np.stack([p.R for p in poses]),
        np.stack([p.t for p in poses]),
        pixels + noise * rng.normal(size=pixels.shape),
    )


def columns(R, t):
    return np.ascontiguousarray(R.transpose(1, 2, 0)), np.ascontiguousarray(t.T)


@pytest.mark.parametrize("sigma", [None, "full"])
@pytest.mark.parametrize("camera", ALL_CAMERAS, ids=lambda camera: camera.lens)
def test_equations_are_those_of_numerical_derivatives(camera, sigma):
    points, R, t, pixels = scene(camera, 3)
    covariances = None if sigma is None else np.broadcast_to([[0.3, 0.1], [0.1, 0.2]], (5, 2, 2))
    weights = whitening(covariances, 5)
    view = Observations.of(camera, points, pixels, weights)
    model = equations(view, *columns(R, t))
    for i in range(len(t)):

        def miss(move, i=i):
            turned = rotation_from_vector(move[:3]) @ R[i]
            off = camera.project(points @ turned.T + t[i] + move[3:]) - pixels[i]
            return np.einsum("acn,nc->na", weights, off).ravel()

        jacobian = approx_fprime(np.zeros(6), miss, 1e-6)
        # A forward difference of 1e-6: the curvature leaves 1e-6 of the largest derivative.
        upper = np.triu(jacobian.T @ jacobian)
        np.testing.assert_allclose(np.triu(model.normal[..., i]), upper, rtol=1e-4, atol=1e-5 * upper.max())
        np.testing.assert_allclose(model.gradient[:, i], jacobian.T @ miss(np.zeros(6)), rtol=1e-3, atol=1e-2)


def test_systems_of_six_are_those_of_lapack():
    rng = np.random.default_rng(22)
    jacobian = rng.normal(size=(50, 9, 6)) * np.array([1e3, 1e3, 1e3, 1.0, 1.0, 1e-3])  # units differ as in a pose
    normal = np.swapaxes(jacobian, 1, 2) @ jacobian
    factor = ldl6.factorise(np.ascontiguousarray(normal.transpose(1, 2, 0)))
    # Conditions up to 1e4 after scaling: 1e-12 of 16 digits.
    scale = np.sqrt(np.einsum("bii->bi", normal))
    product = normal @ ldl6.inverse(factor).transpose(2, 0, 1)
    np.testing.assert_allclose(
        product / scale[:, :, None] * scale[:, None], np.broadcast_to(np.eye(6), product.shape), atol=1e-9
    )
    normal[0, 5] = normal[0, :, 5] = normal[0, 4]
    singular = ldl6.factorise(np.ascontiguousarray(normal.transpose(1, 2, 0)))
    assert np.isnan(ldl6.inverse(singular)[..., 0]).all()

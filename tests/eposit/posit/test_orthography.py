"""The iteration of POSIT as a function of three unknowns, and its Newton steps, against the plain iteration."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from eposit import solve
from eposit.posit import iteration as posit
from eposit.posit.newton import CONTRACTS, STEPS, fixed_points
from eposit.posit.orthography import Orthography, third_axis
from tests.cameras import PAPER_OBJECT, paper_camera, random_object, random_pose


def systems(n: int, count: int, noise_px: float, limit_deg: float = 25.0):
    """One random object and pinhole points of it: the object (n, 3) and images (2, n, b)."""
    rng, camera = np.random.default_rng(3), paper_camera("perspective")
    points = random_object(rng, n)
    poses = [random_pose(rng, points, limit_deg, 0.15) for _ in range(count)]
    pixels = np.stack([camera.project(pose.apply(points)) for pose in poses])
    pixels += noise_px * rng.normal(size=pixels.shape)
    image = (pixels - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    return points, np.ascontiguousarray(image.transpose(2, 1, 0))


@pytest.mark.parametrize("noise_px", [0.0, 0.4, 5.0])
@pytest.mark.parametrize("n", [4, 5, 20])
def test_newton_steps_end_where_the_plain_iteration_does(n, noise_px, monkeypatch):
    points, image = systems(n, 300, noise_px)
    system = Orthography.of(points, image)
    used = system.contraction <= CONTRACTS
    assert used.sum() > 100
    quick = posit.posit(system, 1e-12, 2000)
    monkeypatch.setattr(posit, "NEWTON_TOL", 0.0)
    plain = posit.posit(system, 1e-13, 2000)
    assert np.all(quick.converged[used])
    # With 5 px of noise I and J are far from right angles for some: those go on without Newton steps.
    assert np.mean(quick.iterations[used] <= STEPS) > (0.8 if noise_px == 5.0 else 0.999)
    assert np.median(plain.iterations[used] / quick.iterations[used]) > 1.5
    np.testing.assert_array_equal(quick.converged[~used], plain.converged[~used])
    # Both stop within about 1e-12 of the fixed point in I and J; a rotation amplifies that by at most a few.
    np.testing.assert_allclose(quick.R[..., used], plain.R[..., used], rtol=0, atol=1e-11)
    np.testing.assert_allclose(quick.t[:, used], plain.t[:, used], rtol=1e-11, atol=1e-8)


def test_one_problem_does_not_depend_on_the_others_of_its_batch():
    points, image = systems(4, 200, 0.4)
    system = Orthography.of(points, image)
    rows = np.flatnonzero(system.contraction <= CONTRACTS)
    _, settled, iterations = fixed_points(system.take(rows), 1e-12)
    assert len(set(iterations)) > 1
    for i in range(0, len(rows), 9):
        _, alone, count = fixed_points(system.take(rows[i : i + 1]), 1e-12)
        assert (alone[0], count[0]) == (settled[i], iterations[i])


def test_the_slope_of_the_iteration_stays_below_its_bound():
    points, image = systems(6, 60, 0.0, 50.0)
    system = Orthography.of(points, image)
    found = posit.posit(system, 1e-12, 2000)
    for i in np.flatnonzero(found.converged):
        one = system.take(np.array([i]))
        k = found.R[2, :, i] * system.reach / (found.t[:, i] + found.R[..., i] @ points[0])[2]

        def step(k, one=one):
            return third_axis(one.axes(k[:, None]))[1][:, 0]

        np.testing.assert_allclose(step(k), k, rtol=0, atol=1e-9)
        slope = approx_fprime(k, step, 1e-7)
        # At a noise-free pose I and J are of equal length and at right angles, as the bound supposes.
        assert np.linalg.norm(slope) <= one.contraction[0] + 1e-6


def test_a_limit_of_steps_and_lost_rows_go_the_plain_way():
    points, image = systems(4, 30, 0.4)
    image[0, 2, 7] = np.nan
    found = posit.posit(Orthography.of(points, image), 1e-12, STEPS - 1)
    assert not np.any(found.converged)
    found = posit.posit(Orthography.of(points, image), 1e-12, 2000)
    assert list(np.flatnonzero(~found.converged)) == [7]
    assert np.isnan(found.t[:, 7]).all()


@pytest.mark.parametrize("unit", [1e-12, 1e-3, 1e9, 1e25])
def test_the_unit_of_length_does_not_matter(unit):
    camera = paper_camera("orthogonal")
    rng = np.random.default_rng(5)
    pixels = np.stack(
        [camera.project(random_pose(rng, PAPER_OBJECT, 20.0, 0.1).apply(PAPER_OBJECT)) for _ in range(20)]
    )
    one, other = (solve(scale * PAPER_OBJECT, pixels, camera, "eposit") for scale in (1.0, unit))
    np.testing.assert_array_equal(one.iterations, other.iterations)
    np.testing.assert_allclose(other.cam_from_obj.t, unit * one.cam_from_obj.t, rtol=1e-12)

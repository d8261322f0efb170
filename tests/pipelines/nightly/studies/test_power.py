"""Planted faults in simulated nights: how many are caught, where, and how small they may be.

Every test keeps its part in `out/studies`, and the last one writes `docs/evidence/nightly-power.md`.
"""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest

import eposit
from datasets.plan import plan
from tests.pipelines.nightly.studies import early_ends, faults, found, power
from tests.pipelines.nightly.studies import pool as pools
from tests.pipelines.nightly.studies.pages import power_page
from tests.pipelines.nightly.studies.reading import ALL, NOISY, Reading, Views
from tests.pipelines.nightly.studies.simulated_nights import OTHER, SAME, Planted, Stage

NIGHTS, TRIES = 200, 40  # of a share; of a step of the search for the smallest size
SIZES, NOISES = (20, 80), (SAME, OTHER)
STEPS = 4
SLOWER = 0.15
PLANTED = (faults.CORNER_BIAS, faults.MORE_NOISE, faults.CIRCLE, faults.FOCAL, faults.COVARIANCE, faults.SHIFT)
ALL_PLANTED = (
    *((fault.name, Planted(fault, fault.size)) for fault in PLANTED),
    ("slower detection", Planted(slower=SLOWER)),
    ("new failure", Planted(faults.FAILURE, 1)),
)
SEARCHES = ((20, SAME, 8, 5), (20, OTHER, TRIES, 5), (80, OTHER, TRIES, 5))


@pytest.mark.slow
@pytest.mark.parametrize("poses", SIZES)
@pytest.mark.parametrize("noise", NOISES)
def test_power(poses, noise):
    """Every fault in the same 200 nights."""
    begun, pool = time.process_time(), pools.pool()
    counts = {name: [0, 0] for name, _ in ALL_PLANTED}
    for i in range(NIGHTS):
        nights = [Stage(pool, poses, noise, (poses, i))]
        for name, planted in ALL_PLANTED:
            one = power.share(nights, planted)
            counts[name] = [counts[name][0] + one.caught, counts[name][1] + one.right]
    rows = {name: [value / NIGHTS for value in both] for name, both in counts.items()}
    found.keep(f"power-{noise} {poses}", {"shares": rows, "processor_s": time.process_time() - begun})
    power_page()
    assert noise == OTHER or all(caught >= power.LEAST for caught, _ in rows.values())


@pytest.mark.slow
@pytest.mark.parametrize(("poses", "noise", "tries", "steps"), SEARCHES)
def test_smallest_size(poses, noise, tries, steps):
    """On the same pictures nothing scatters, so that few nights tell."""
    begun = time.process_time()
    nights = power.stages(pools.pool(), poses, noise, tries)
    rows = {fault.name: power.smallest(nights, fault, fault.size / 16.0, fault.size * 4.0, steps) for fault in PLANTED}
    kept = {"smallest": rows, "processor_s": time.process_time() - begun}
    found.keep(f"power-smallest-{noise} {poses}", kept)
    power_page()


@pytest.mark.slow
def test_power_of_an_early_end():
    """Each number of steps before the end, on the same pictures; and by how much poses are off."""
    begun, pool = time.process_time(), pools.pool()
    moves = early_ends.moves(pool, STEPS)
    fault = faults.Fault("early end", "steps", 1, faults.early_end(moves), faults.POSES, everywhere=True)
    rows, nights = [], power.stages(pool, SIZES[0], SAME, NIGHTS)
    for steps in range(1, STEPS + 1):
        shares = power.share(nights, Planted(fault, steps))
        rows.append({"steps": steps, "off": _off(pool, moves, steps)} | dataclasses.asdict(shares))
    found.keep("power-early-end", {"rows": rows, "processor_s": time.process_time() - begun})
    power_page()


def _off(pool, moves, steps):
    """Largest and median move of each setting, in the poses' stated deviations, by way of the metrics' own numbers."""
    views = Views.drawn(pool, pool.slope.shape[0], np.random.default_rng(0))
    clean, early = Reading(views), Reading(views)
    faults.early_end(moves)(early, steps, None)
    off = {}
    for before, after in zip(clean.slices(), early.slices(), strict=True):
        names = [name for name in after.values if name.endswith("_normalised")]
        if names:
            worst = np.max([np.abs(after.values[name] - before.values[name]) for name in names], axis=0)
            off.setdefault(after.system, []).append(worst)
    return {system: [float(np.nanmedian(np.hstack(of))), float(np.nanmax(np.hstack(of)))] for system, of in off.items()}


@pytest.mark.slow
@pytest.mark.parametrize("poses", SIZES)
def test_power_of_a_drift(poses):
    begun, pool = time.process_time(), pools.pool()
    rows = {noise: power.drift_nights(pool, poses, noise, NIGHTS) for noise in NOISES}
    found.keep(f"power-drift-{poses}", {"nights": rows, "processor_s": time.process_time() - begun})
    power_page()
    assert all(0 < night <= power.DRIFT_NIGHTS for night in rows[SAME])


@pytest.fixture(scope="module")
def synthetic():
    pool = pools.synthetic(24, np.random.default_rng(0))
    return pool, power.stages(pool, 20, SAME, 3)


@pytest.mark.parametrize(("name", "planted"), ALL_PLANTED)
def test_a_planted_fault_is_caught_where_it_is(synthetic, name, planted):
    """Three nights on the same pictures, where nothing but chance in the fault scatters."""
    assert power.share(synthetic[1], planted) == power.Share(3, 1.0, 1.0), name


def test_a_drift_is_caught_at_the_latest_when_it_passes_the_margin(synthetic):
    """Corners are 0.0005 px off after five nights; poses, which average them, may tell sooner."""
    (night,) = power.drift_nights(synthetic[0], 20, SAME, 1)
    assert 1 <= night <= 6


def test_poses_to_first_order_are_the_solvers(synthetic):
    """Components over their deviations to 0.01: errors of the second order in 0.005 px, or in 0.4 px, over 2 m."""
    recipe, pool = pools.recipe_of(pools.REGIMES[0]), synthetic[0]
    views = Views.drawn(pool, 24, np.random.default_rng(1))
    slices = {(item.camera, item.system): item for item in Reading(views).slices() if item.regime == pools.REGIMES[0]}
    for frame in plan(recipe)[:10]:
        camera, truth = frame.camera.true_camera(), frame.cam_from_obj
        at = 0, views.draw[0, frame.pose_id, frame.frame_id % 5], frame.pose_id, frame.frame_id % 5
        for system, error, sigma in (
            (ALL, pool.error[at], pool.covariance[at]),
            (NOISY, views.noise_px[frame.pose_id], 0.4),
        ):
            pixels = camera.project(truth.apply(recipe.target.points)) + error
            solved = eposit.solve(recipe.target.points, pixels, camera, sigma_px=sigma)
            off = (solved.cam_from_obj.t - truth.t) / np.sqrt(np.diag(solved.covariance)[3:])
            known = slices[frame.camera.name, system].values
            wanted = [known[f"t{axis}_normalised"][frame.pose_id] for axis in "xyz"]
            np.testing.assert_allclose(off, wanted, atol=0.01 if system == ALL else 0.05)

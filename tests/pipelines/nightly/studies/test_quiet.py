"""Nights without a fault: how many end with an alarm, over all gates together.

Candidate and baseline read pictures with other noise, which is as far apart as two systems of the same accuracy can be;
on the same pictures the same code gives the same numbers, and there is nothing to alarm. The findings stay in
`out/studies`, and the last study writes `docs/evidence/nightly-quiet.md`.
"""

from __future__ import annotations

import time
from collections import Counter

import numpy as np
import pytest

from pipelines.nightly.gates import accuracy
from pipelines.nightly.judgement import judge_slices
from tests.pipelines.nightly import simulated
from tests.pipelines.nightly.studies import found
from tests.pipelines.nightly.studies import pool as pools
from tests.pipelines.nightly.studies.pages import quiet_page
from tests.pipelines.nightly.studies.reading import ALL, DETECTOR, Reading, Views
from tests.pipelines.nightly.studies.simulated_nights import OTHER, Planted, failed, is_worse, run

NIGHTS = 1000
MOST_ALARMS = 10  # of 1000: one in a hundred nights


@pytest.mark.slow
@pytest.mark.parametrize("poses", [20, 80])
def test_quiet_nights(poses):
    begun, pool = time.process_time(), pools.pool()
    nights = [run(pool, poses, Planted(), OTHER, (poses, i)) for i in range(NIGHTS)]
    alarms = Counter(item.gate for night in nights for item in failed(night))
    states = Counter(f"{item.gate} {item.state}" for night in nights for item in night.outcomes)
    rows = {"nights": NIGHTS, "alarms": sum(map(is_worse, nights)), "by_gate": alarms, "states": states}
    found.keep(f"quiet-{poses}", rows | {"processor_s": time.process_time() - begun})
    quiet_page()
    assert rows["alarms"] <= MOST_ALARMS


@pytest.mark.slow
def test_scatter():
    """The scatter of every metric over poses and over draws, for the page; that of `simulated` agrees to a tenth."""
    rows = _scatter(pools.pool())
    found.keep("scatter", {"rows": rows})
    quiet_page()
    over_poses = {tuple(row[:3]): row[4] for row in rows}
    for system, metric, scatter in (
        (DETECTOR, "corner_x", simulated.CORNER_SCATTER_PX),
        (DETECTOR, "circle_x", simulated.CIRCLE_SCATTER_PX),
        (DETECTOR, "corner_nees", simulated.NEES_SCATTER),
        (ALL, "pose_log_t", simulated.LOG_LENGTH_SCATTER),
        (ALL, "tx_normalised", 1.0),
    ):
        assert over_poses["typical", system, metric] == pytest.approx(scatter, rel=0.1)


def _scatter(pool):
    """Regime, system and metric; mean, scatter over poses, and scatter of one frame over draws; of all lenses."""
    views = [Views.drawn(pool, pool.slope.shape[0], np.random.default_rng(0))]
    views += [Views(pool, views[0].pose, np.full_like(views[0].draw, d), views[0].noise_px) for d in range(pools.DRAWS)]
    draws = [Reading(view).slices() for view in views[1:]]
    rows = []
    for regime in pools.REGIMES:
        for system in dict.fromkeys(item.system for item in draws[0]):
            of = [[item for item in draw if (item.regime, item.system) == (regime, system)] for draw in draws]
            for metric in of[0][0].values:
                values = np.array([[item.values[metric] for item in draw] for draw in of])  # draws, lenses, poses
                spread = float(np.nanmean(np.nanstd(values, axis=2, ddof=1)))
                own = float(np.sqrt(np.mean(np.var(values, axis=0, ddof=1)[np.isfinite(values[0])])))
                rows.append([regime, system, metric, float(np.nanmean(values)), spread, own])
    return rows


def test_the_same_pictures_give_no_difference_at_all():
    pool = pools.synthetic(20, np.random.default_rng(0))
    views = Views.drawn(pool, 20, np.random.default_rng(1))
    judged = judge_slices(Reading(views).slices(), Reading(views).slices(), accuracy.ALPHA, paired=True)
    assert judged.identical
    assert len(judged.findings) == 2 * 5 * (7 + 3 * 9)  # regimes, lenses, metrics of points and of three settings


def test_quiet_nights_end_without_an_alarm():
    """Ten nights of other noise: at one alarm in 100 nights, two or more have a chance of .004."""
    pool = pools.synthetic(24, np.random.default_rng(2))
    nights = [run(pool, 20, Planted(), OTHER, (3, i)) for i in range(10)]
    assert sum(map(is_worse, nights)) <= 1
    slices = Reading(Views.drawn(pool, 20, np.random.default_rng(4))).slices()
    assert {item.system for item in slices if "corner_x" in item.values} == {DETECTOR}

"""Whole nights: planted faults are found where they are, nights without one are quiet."""

import numpy as np
import pyarrow as pa
import pytest

from pipelines.nightly.comparison import Verdict
from pipelines.nightly.judgement import judge
from pipelines.nightly.metrics import METRICS
from tests.pipelines.nightly import simulated

ALPHA = 0.01


def _worse(poses, seed, fault=None):
    rng = np.random.default_rng(seed)
    found = judge(simulated.night(poses, rng), simulated.night(poses, rng, fault), ALPHA, paired=True)
    return {(item.slice, item.change.metric.name) for item in found.of(Verdict.WORSE)}


@pytest.mark.parametrize(
    ("fault", "metrics"),
    [
        (simulated.corner_bias(0.002), {"corner_x"}),
        (simulated.more_noise(1.1), {"corner_log_ms", "corner_nees"}),
        (simulated.stated_covariance(0.85), {"corner_nees"}),
    ],
)
def test_a_planted_fault_is_found_in_its_slice_and_nowhere_else(fault, metrics):
    """20 poses; the sizes of the faults are those that a night must see every time."""
    for seed in range(5):
        found = _worse(20, seed, fault)
        assert {name for _, name in found} <= metrics
        assert found
        assert {name.split("/")[1] for name, _ in found} == {"equisolid"}


def test_nights_without_a_fault_are_quiet():
    """30 nights at 1 %: more than two alarms have a chance of .003."""
    assert sum(bool(_worse(20, 100 + seed)) for seed in range(30)) <= 2


def test_the_same_numbers_are_identical():
    night = simulated.night(10, np.random.default_rng(0))
    found = judge(night, night, ALPHA, paired=True)
    assert found.identical
    assert not found.of(Verdict.WORSE)
    assert {item.verdict for item in found.findings} == {Verdict.EQUAL}


def test_other_views_are_compared_as_two_samples():
    rng = np.random.default_rng(1)
    old, new = simulated.night(40, rng), simulated.night(25, rng, simulated.corner_bias(0.003))
    found = judge(old, new, ALPHA, paired=False)
    assert not found.paired
    assert not found.failures
    assert [item.change.metric.name for item in found.of(Verdict.WORSE)] == ["corner_x"]


def test_a_frame_that_fails_anew_is_named():
    night = simulated.night(10, np.random.default_rng(2))
    failed = night["failed"].to_numpy(zero_copy_only=False).copy()
    failed[3] = True
    broken = night.set_column(night.schema.get_field_index("failed"), "failed", pa.array(failed))
    found = judge(night, broken, ALPHA, paired=True)
    assert [(item.slice, item.new) for item in found.failures if item.new] == [("typical/perspective/edge-fit", (3,))]
    back = judge(broken, night, ALPHA, paired=True)
    assert back.new_failures == 0
    assert [item.mended for item in back.failures if item.mended] == [(3,)]


def test_slices_of_one_side_only_are_told():
    night = simulated.night(10, np.random.default_rng(3))
    some = night.filter(pa.array(np.array(night["camera_name"].to_pylist()) != "orthogonal"))
    found = judge(night, some, ALPHA, paired=True)
    assert {name.split("/")[1] for name in found.only_old} == {"orthogonal"}
    assert not found.only_new
    assert not found.identical


@pytest.mark.parametrize("metric", ["corner_nees", "circle_x"])
def test_a_number_that_is_gone_is_a_failure_and_not_left_out(metric):
    """Without stated covariances, or without the circle, nothing else gets worse: means are over what is left."""
    night = simulated.night(10, np.random.default_rng(4))
    values = night[metric].to_numpy(zero_copy_only=False).copy()
    some, column = values.copy(), night.schema.get_field_index(metric)
    some[[2, 5]] = np.nan
    for kept, frames, lost in ((some, {2, 5}, 0), (np.full_like(values, np.nan), set(range(10)), 5)):
        cut = night.set_column(column, metric, pa.array(kept, mask=np.isnan(kept)))
        found = judge(night, cut, ALPHA, paired=True)
        assert {frame for item in found.failures for frame in item.new} == frames
        assert len(found.lost) == lost
        assert judge(cut, night, ALPHA, paired=True).new_failures == 0


@pytest.mark.parametrize("paired", [True, False])
def test_a_system_that_fails_in_every_frame_is_judged(paired):
    """It has no metric left to compare; its failures are told all the same."""
    night = simulated.night(10, np.random.default_rng(5))
    broken = pa.table({name: pa.nulls(len(night), night.schema.field(name).type) if name in METRICS else night[name]
                       for name in night.schema.names})  # fmt: skip
    broken = broken.set_column(broken.schema.get_field_index("failed"), "failed", pa.array([True] * len(night)))
    found = judge(night, broken, ALPHA, paired=paired)
    assert not found.findings
    assert found.new_failures == (len(night) if paired else 0)
    assert found.lost

"""Each gate by itself: every state that it can end in, and what it tells."""

import contextlib
import dataclasses

import numpy as np
import pyarrow as pa
import pytest

from pipelines.nightly.differences import other_code, other_machine
from pipelines.nightly.gates import accuracy, data, failures, fresh, regenerate, replay, speed, tail
from pipelines.nightly.judgement import Failures, judge
from pipelines.nightly.other_code import ROOT, Code
from pipelines.nightly.record import Exit, State, Timing
from render.targets.image_region import Region
from tests.pipelines.nightly import simulated

POSES = 20
SLICE = "typical/equisolid/edge-fit"
BIAS = simulated.corner_bias(0.002)
OTHER = "numpy is 2.4 instead of 2.3"


def nobody(*_):
    return False


def everybody(*_):
    return True


def _pair(fault=None, seed=0, poses=POSES, step=0.0):
    """Baseline's and candidate's measures of the same pictures. step: moves every corner of every camera along x."""
    old, new = (simulated.night(poses, np.random.default_rng(seed), plant) for plant in (None, fault))
    place = new.schema.get_field_index("corner_x")
    return old, new.set_column(place, new.schema.field("corner_x"), _moved(new["corner_x"], step))


def _moved(column, step):
    values = column.to_numpy(zero_copy_only=False) + step
    return pa.array(values, pa.float64(), mask=np.isnan(values))


def _judged(*words, **named):
    return judge(*_pair(*words, **named), accuracy.ALPHA, paired=True)


def test_accuracy_of_the_same_numbers_passes():
    found = accuracy.judge(_judged(), nobody)
    assert found.state is State.PASSED
    assert "the same as the baseline's" in found.sentence


def test_accuracy_within_the_margins_passes():
    found = accuracy.judge(_judged(step=1e-6), nobody)
    assert (found.state, found.exit) == (State.PASSED, Exit.FINE)
    assert "equal within their margins" in found.sentence


def test_accuracy_that_is_worse_fails_and_names_it():
    found = accuracy.judge(_judged(BIAS), nobody)
    assert (found.state, found.exit) == (State.FAILED, Exit.WORSE)
    assert [(item.slice, item.change.metric.name) for item in found.findings] == [(SLICE, "corner_x")]
    assert found.sentence.startswith(f"corner_x in {SLICE} is worse by +0.002")


def test_accuracy_is_waived_only_if_all_that_is_worse_is():
    judged = _judged(BIAS)
    assert accuracy.judge(judged, lambda *what: what == (SLICE, "corner_x")).state is State.WAIVED
    assert accuracy.judge(judged, lambda *what: what == (SLICE, "corner_y")).state is State.FAILED


def test_accuracy_that_is_better_is_changed():
    worse, better = _pair(BIAS)[::-1]
    found = accuracy.judge(judge(worse, better, accuracy.ALPHA, paired=True), nobody)
    assert (found.state, found.exit) == (State.CHANGED, Exit.FINE)


def test_accuracy_that_scatters_warns():
    """Other pictures on either side, as far as the numbers go: the scatter hides what the margins ask for."""
    sides = (simulated.night(POSES, np.random.default_rng(seed)) for seed in (1, 2))
    found = accuracy.judge(judge(*sides, accuracy.ALPHA, paired=True), nobody)
    assert (found.state, found.exit) == (State.WARNED, Exit.FINE)


def test_data():
    assert data.judge("a" * 64, "a" * 64).state is State.PASSED
    found = data.judge("a" * 64, "b" * 64)
    assert (found.state, found.exit) == (State.FAILED, Exit.NO_VERDICT)


@pytest.mark.parametrize(
    ("grey", "points", "same", "state"),
    [
        (0, 0.0, True, State.PASSED),
        (1, 0.0, True, State.FAILED),
        (0, 1e-12, True, State.FAILED),
        (1, 1e-10, False, State.CHANGED),
        (0, 0.0, False, State.CHANGED),
        (2, 0.0, False, State.FAILED),
        (0, 1e-8, False, State.FAILED),
        (0, float("nan"), False, State.FAILED),
    ],
)
def test_regenerate(grey, points, same, state):
    stored = np.full((4, 6), 250, np.uint8)
    other = stored.copy()
    other[1, 2] += grey
    region = Region(0, 0, 6, 4)
    frames = [
        regenerate.Again("pinned-typical", 3, stored, stored, region, 0.0),
        regenerate.Again("pinned-typical", 7, stored, other, region, points),
    ]
    assert [item.differs for item in frames] == [False, bool(grey or points)]
    found = regenerate.judge(frames, () if same else (OTHER,))
    assert found.state is state
    if state is State.FAILED:
        assert found.exit is Exit.NO_VERDICT
        assert found.frames == (("pinned-typical", 7),)
    assert found.sentence.endswith(OTHER) is not same


def test_replay_never_fails_and_tells_how_far_and_why():
    old = {"typical truth": "a", "typical noisy": "b"}
    assert replay.judge(old, old, 0.0, ()).state is State.PASSED
    for reasons, told in (((OTHER,), OTHER), ((), "code, versions and machine are the baseline's")):
        found = replay.judge(old, old | {"typical noisy": "c"}, 2e-9, reasons)
        assert found.state is State.CHANGED
        assert found.sentence.endswith(f"by at most 2e-09 of themselves; {told}")
    assert replay.judge({}, old, 0.0, ()).state is State.NOT_RUN


def test_replay_measures_poses_from_noisy_points_only():
    """A system of that name has errors that are a quarter longer in one frame."""
    old = simulated.night(POSES, np.random.default_rng(0))
    assert np.isnan(replay.largest_change(old, old))
    name, place = "pose_log_R", old.schema.get_field_index("pose_log_R")
    systems = [text.replace("detected", "truth+0.4px") for text in old["system"].to_pylist()]
    noisy = old.set_column(old.schema.get_field_index("system"), "system", pa.array(systems))
    values = old[name].to_numpy(zero_copy_only=False).copy()
    values[np.flatnonzero(np.isfinite(values))[3]] += np.log(1.25)
    column = pa.array(values, mask=np.isnan(values))
    assert replay.largest_change(noisy, noisy.set_column(place, name, column)) == pytest.approx(0.25)
    assert np.isnan(replay.largest_change(old, old.set_column(place, name, column)))


def test_differences_are_told_with_both_values():
    assert other_machine({"numpy": "2.3", "blas": "a"}, {"numpy": "2.4", "blas": "a"}) == (
        "numpy is 2.4 instead of 2.3",
    )
    assert other_machine({}, {"numpy": "2.4"}) == ("numpy is 2.4 instead of unknown",)
    assert other_code("a", "a") == ()
    assert other_code(None, "a") == ("the code is not the baseline's",)


def _fresh(first, second, waived=nobody):
    """Outcome of two looks, each a fault or None, and how often the second was asked for."""
    asked = []

    def again():
        asked.append(1)
        return judge(*_pair(second, seed=2), fresh.ALPHA, paired=True)

    return fresh.judge(judge(*_pair(first, seed=1), fresh.ALPHA, paired=True), again, waived), len(asked)


def test_fresh_looks_again_only_at_what_it_flags():
    found, asked = _fresh(None, BIAS)
    assert (found.state, asked) == (State.PASSED, 0)


def test_fresh_fails_by_what_shows_twice():
    found, asked = _fresh(BIAS, BIAS)
    assert (found.state, found.exit, asked) == (State.FAILED, Exit.WORSE, 1)
    assert [(item.slice, item.change.metric.name) for item in found.findings] == [(SLICE, "corner_x")]


def test_fresh_does_not_believe_one_look():
    found, asked = _fresh(BIAS, None)
    assert (found.state, asked) == (State.PASSED, 1)
    assert "as chance does" in found.sentence


def test_fresh_is_waived():
    assert _fresh(BIAS, BIAS, everybody)[0].state is State.WAIVED


def _with_failures(new=(), mended=()):
    return dataclasses.replace(_judged(), failures=(Failures(SLICE, 400, tuple(new), tuple(mended)),))


def test_failures_on_pinned_pictures():
    assert failures.judge(_with_failures(), None, nobody).state is State.PASSED
    assert failures.judge(_with_failures(mended=(3,)), None, nobody).state is State.CHANGED
    found = failures.judge(_with_failures(new=(3, 5)), None, lambda *what: what == (SLICE, 5))
    assert (found.state, found.exit) == (State.FAILED, Exit.WORSE)
    assert found.frames == (("pinned", 3),)
    assert found.sentence == f"1 new failure: frame 3 in {SLICE}"
    assert failures.judge(_with_failures(new=(3, 5)), None, everybody).state is State.WAIVED


def test_failures_on_fresh_pictures_are_counted():
    """7 of 7 are more than chance at 1 % (1/128), 6 of 6 are not (1/64)."""
    for count, state in ((6, State.PASSED), (7, State.FAILED)):
        found = failures.judge(_with_failures(), _with_failures(new=range(count)), nobody)
        assert found.state is state
    assert found.frames[0] == ("fresh", 0)


TAIL = ("typical/edge-fit", "corner_log_ms")


def _tail(waived=nobody, poses=80, spoilt=30):
    """30 frames of 400 whose error is ten times as large: no mean of a camera tells them from a bad night."""
    old, new = _pair(poses=poses)
    name = "corner_log_ms"
    values = new[name].to_numpy(zero_copy_only=False).copy()
    held = np.flatnonzero(np.isfinite(values))
    values[held[:: len(held) // spoilt][:spoilt]] += 2.0 * np.log(10.0)
    new = new.set_column(new.schema.get_field_index(name), new.schema.field(name), _moved(pa.array(values), 0.0))
    return tail.judge(old, new, waived)


def test_tail():
    found = _tail()
    assert (found.state, found.exit) == (State.FAILED, Exit.WORSE)
    assert found.sentence.startswith("corner_log_ms of typical/edge-fit: ")
    assert _tail(lambda *what: what == TAIL).state is State.WAIVED
    assert tail.judge(*_pair(poses=80), nobody).state is State.PASSED
    assert _tail(poses=79).state is State.NOT_RUN  # 395 frames


@pytest.mark.parametrize(("ratio", "state"), [(1.05, State.PASSED), (1.10, State.PASSED), (1.11, State.FAILED)])
def test_speed(ratio, state):
    timings = [Timing("detect", 0.99, 0.98, 1.0, 17.0, 16.8), Timing("estimate", ratio, 1.0, 1.2, 1.0, ratio)]
    found = speed.judge(timings, nobody)
    assert found.state is state
    if state is State.FAILED:
        assert found.exit is Exit.WORSE
        assert found.sentence.startswith("estimate takes 1.11 times")
        assert speed.judge(timings, lambda stage: stage == "estimate").state is State.WAIVED
        assert speed.judge(timings, lambda stage: stage == "detect").state is State.FAILED


def test_speed_is_waived_only_if_every_slow_stage_is():
    slow = [Timing(stage, 1.2, 1.1, 1.3, 1.0, 1.2) for stage in ("detect", "estimate")]
    assert speed.judge(slow, lambda stage: stage == "detect").state is State.FAILED
    assert speed.judge(slow, everybody).state is State.WAIVED


@pytest.mark.parametrize("scatter", [0.01, 0.3])
def test_speed_takes_more_turns_where_times_scatter(scatter, monkeypatch):
    """One turn scatters by 1 %, or by 30 %, far more than on a crowded machine: a quarter is told from nothing."""
    rng, taken = np.random.default_rng(5), []

    def turn(factor):
        taken.append(factor)
        return {stage: factor * rng.lognormal(0.0, scatter) for stage in ("detect", "estimate")}

    for slower, state in ((1.0, State.PASSED), (1.25, State.FAILED)):
        factors = iter((1.0, slower))
        monkeypatch.setattr(speed, "_running", lambda *_, own=factors: contextlib.nullcontext(next(own)))
        monkeypatch.setattr(speed, "_turn", turn)
        taken.clear()
        found = speed.time_both(Code(ROOT), Code(ROOT), (ROOT, ROOT), 20)
        assert speed.judge(found, nobody).state is state
        turns = (len(taken) - 4) // 4  # but for the first two of each process
        assert turns == speed.TURNS if scatter == 0.01 else speed.TURNS < turns <= speed.MOST_TURNS

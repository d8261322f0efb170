"""The worst frames: failures first, then by how far the worse numbers moved, each frame once."""

from pathlib import Path

import numpy as np

from pipelines.nightly.judgement import judge
from pipelines.nightly.worst_frames import MOST_FRAMES, worst
from tests.pipelines.nightly import simulated
from tests.pipelines.nightly.whole_nights import results

SLICE = "typical/equisolid/edge-fit"


def _bias_of_some(values):
    """Corners of equisolid move along x, later frames further; lengths of translation errors shrink by far more."""
    values["corner_x"] += 0.002 + 1e-5 * np.arange(20)
    values["pose_log_t"] -= 10.0


def test_frames_are_those_of_the_slice_that_is_worse():
    night = results(_bias_of_some)
    found = worst(night.measures, night.findings)
    assert len(found) == MOST_FRAMES
    assert {(item.slice, item.suite) for item in found} == {
        (SLICE, "pinned-typical"),
        (SLICE, "fresh-typical"),
    }
    assert [item.frame_id for item in found] == [number for number in range(19, 13, -1) for _ in range(2)]
    assert found[0].reason.startswith("corner_x ")
    assert found[0].reason.endswith(" px")


def test_failures_come_first():
    night = results(_bias_of_some, failing=(3, 5))
    found = worst(night.measures, night.findings)
    assert [(item.frame_id, item.reason) for item in found[:2]] == [
        (3, "fails, and did not before"),
        (5, "fails, and did not before"),
    ]
    assert found[2].frame_id == 19


def test_without_a_worse_metric_all_of_them_count():
    old, new = (simulated.night(20, np.random.default_rng(seed)) for seed in (1, 2))
    found = worst({"pinned old": old, "pinned new": new}, {"pinned": judge(old, old, 0.01, paired=True).findings})
    assert len(found) == MOST_FRAMES
    assert [item.margins for item in found] == sorted((item.margins for item in found), reverse=True)


def test_the_same_numbers_show_nothing():
    night = results()
    assert worst(night.measures, night.findings) == []


def test_the_command_is_quoted():
    night = results(_bias_of_some)
    wanted = worst(night.measures, night.findings)[0].wanted("RUN", Path("a folder"))
    assert wanted.command == (
        "python -m pipelines nightly frame pinned-typical 19 --run RUN --history 'a folder' --out frame.png"
    )

"""What all outputs are written from: lenses, changes in their order, counts; and that all are written."""

import dataclasses

import pytest

from datasets.errors import UserError
from pipelines.nightly.comparison import Verdict
from pipelines.nightly.outputs import write_all
from pipelines.nightly.record import Exit, State
from tests.pipelines.nightly import simulated
from tests.pipelines.nightly.whole_nights import results


def test_lenses_are_regime_and_camera_without_the_system():
    assert results().lenses() == sorted(f"typical/{camera}" for camera in simulated.CAMERAS)


def test_the_lens_of_a_frame_is_the_one_in_which_it_fails_anew():
    """All lenses of the simulated nights number their frames alike, as two regimes do."""
    night = results(failing=(3,))
    assert night.lenses_of_frame("pinned", 3) == {"typical/perspective"}
    assert night.lenses_of_frame("pinned", 4) == set(night.lenses())
    assert night.lenses_of_frame("pinned", 999) == set()
    assert night.lenses_of_frame("none", 3) == set()


def test_what_is_worse_comes_first_and_the_largest_of_it():
    def plant(values):
        values["corner_x"] += 0.003
        values["corner_y"] += 0.006
        values["pose_log_t"] -= 9.0

    found = results(plant).changes()
    assert {suite for suite, _ in found} == {"pinned", "fresh"}
    assert [item.verdict for _, item in found] == [Verdict.WORSE] * 4 + [Verdict.BETTER]
    assert [item.change.metric.name for _, item in found[:4]] == ["corner_y", "corner_y", "corner_x", "corner_x"]


def test_what_a_second_look_did_not_confirm_is_no_change():
    night = results(simulated.corner_bias(0.002))
    assert {suite for suite, _ in night.changes()} == {"pinned", "fresh"}
    flagged = [
        dataclasses.replace(item, state=State.PASSED, exit=Exit.FINE) if item.gate == "fresh" else item
        for item in night.night.outcomes
    ]
    quiet = dataclasses.replace(night, night=dataclasses.replace(night.night, outcomes=tuple(flagged)))
    assert {suite for suite, _ in quiet.changes()} == {"pinned"}


def test_failed_frames_are_counted():
    counts = {(item.suite, item.side, item.slice): item for item in results(failing=(3, 4)).counts()}
    assert len(counts) == 2 * 2 * 10
    assert counts["pinned", "new", "typical/perspective/edge-fit"].failed == 2
    assert counts["pinned", "old", "typical/perspective/edge-fit"].failed == 0
    assert {item.frames for item in counts.values()} == {20}


def test_all_files_are_written_and_nothing_else(tmp_path):
    paths = write_all(results(), tmp_path / "out")
    assert sorted(path.name for path in paths) == ["junit.xml", "metrics.json", "metrics.prom", "summary.md"]
    assert sorted((tmp_path / "out").iterdir()) == sorted(paths)
    before = [path.read_bytes() for path in paths]
    write_all(results(), tmp_path / "out")
    assert [path.read_bytes() for path in paths] == before


def test_a_folder_that_cannot_be_written_is_a_sentence(tmp_path):
    (tmp_path / "out").write_text("a file")
    with pytest.raises(UserError, match="cannot write"):
        write_all(results(), tmp_path / "out")

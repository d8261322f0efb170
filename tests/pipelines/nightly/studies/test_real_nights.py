"""Whole nights on real pictures: planted faults end with exit code 1 and their slice, nights without one are quiet.

Five histories, each with pinned pictures of its own and four quiet nights of new seeds, twenty in all; each fault is
planted once in every history, on pinned pictures and on the views of two fresh seeds. What was found is kept in
`out/studies`, from which `test_pages` writes the evidence. A history takes four to five minutes of processor time.
"""

from __future__ import annotations

import time

import pytest

from datasets.rows import points_by_frame
from datasets.store.dataset import open_dataset
from pipelines.nightly.record import Exit, State
from tests.pipelines.nightly.studies import faults, found, real_faults
from tests.pipelines.nightly.studies.reading import ALL, DETECTOR, FOUR, NOISY
from tests.pipelines.nightly.studies.real_nights import SEED, Fault, Studio

HISTORIES, QUIET_NIGHTS = 5, 4
DRIFT_PX, DRIFT_NIGHTS = 0.0001, 30
STEPS = (1, 2, 3, 4)  # by which the solver ends early

POINTS, POSES = (DETECTOR,), (ALL, FOUR, NOISY)
PLANTED = (  # name as in the simulated nights, fault, systems whose slices it is in
    (faults.CORNER_BIAS, real_faults.corner_bias, POINTS),
    (faults.MORE_NOISE, real_faults.more_noise, POINTS),
    (faults.CIRCLE, real_faults.circle_shift, POINTS),
    (faults.FOCAL, real_faults.longer_focal_length, POSES),
    (faults.COVARIANCE, real_faults.small_covariance, POINTS),
    (faults.SHIFT, real_faults.shift, POINTS),
)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(HISTORIES))
def test_real_nights(number, tmp_path):
    """Quiet nights first: what they compute serves the others."""
    begun = time.process_time()
    studio = Studio(tmp_path)
    studio.history(number)
    rows = [_row("none", "", studio.night(number, SEED + 1 + i, without=())) for i in range(QUIET_NIGHTS)]
    for fault, plant, systems in PLANTED:
        night = studio.night(number, SEED + 1, plant(fault.size))
        rows.append(_row(fault.name, fault.size, night) | _named(night, systems, everywhere=fault.everywhere))
    rows += [_row("early end", steps, studio.night(number, SEED + 1, Fault(steps=steps))) for steps in STEPS]
    rows.append(_row("slower detection", 0.15, studio.night(number, SEED, Fault(slower=0.15), without=("fresh",))))
    rows += [_failure(studio, number), _drift(studio, number)]
    found.keep(f"real-{number}", {"rows": rows, "processor_s": time.process_time() - begun})
    quiet = [row for row in rows if row["fault"] == "none"]
    assert [row["exit"] for row in quiet] == [0] * QUIET_NIGHTS
    assert all(row["identical"] for row in quiet)


def _row(fault, size, night):
    failed = [item for item in night.outcomes if item.state is State.FAILED]
    return {
        "fault": fault,
        "size": size,
        "exit": int(night.exit),
        "gates": {item.gate: str(item.state) for item in night.outcomes},
        "sentence": night.sentence,
        "named": sorted({finding.slice for item in failed for finding in item.findings}),
        "identical": any(
            "same as the baseline's" in item.sentence for item in night.outcomes if item.gate == "accuracy"
        ),
        "speed": {item.stage: item.ratio for item in night.timings},
        "replay": next((item.sentence for item in night.outcomes if item.gate == "replay"), ""),
    }


def _named(night, systems, *, everywhere):
    """Whether it names a slice of the fault's own systems, in its lens, and whether it names another lens."""
    named = [
        item.slice.split("/")
        for outcome in night.outcomes
        if outcome.state is State.FAILED
        for item in outcome.findings
    ]
    own = [name for name in named if name[2] in systems and (everywhere or name[1] == faults.LENS)]
    return {"right": bool(own), "other_lens": not everywhere and any(name[1] != faults.LENS for name in named)}


def _failure(studio, number):
    """A picture of one lens in which no board is found any more."""
    pinned = open_dataset(studio.folder / f"history-{number}" / "pictures" / "pinned-typical")
    rows = pinned.read("frames", ["frame_id", "camera_name"]).to_pylist()
    frame_id = next(row["frame_id"] for row in rows if row["camera_name"] == faults.LENS)
    target = pinned.recipe.target
    truth = points_by_frame(pinned.read("keypoints"), target)[frame_id]
    night = studio.night(number, SEED + 1, real_faults.new_failure(target, truth))
    frames = [item.frames for item in night.outcomes if item.gate == "failures"]
    right = [of_suite for of_suite, _ in frames[0]].count("pinned") == 1 and ("pinned", frame_id) in frames[0]
    return _row("new failure", 1, night) | {"right": right, "other_lens": False}


def _drift(studio, number):
    """The bias grows from night to night; the first night that ends with exit code 1."""
    for count in range(1, DRIFT_NIGHTS + 1):
        night = studio.night(number, SEED, real_faults.corner_bias(count * DRIFT_PX), without=("fresh", "speed"))
        if night.exit is Exit.WORSE:
            return _row("drift", count, night) | _named(night, (*POINTS, *POSES), everywhere=False)
    return _row("drift", 0, night) | {"right": False, "other_lens": False}

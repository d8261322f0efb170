"""Whole nights without pictures: simulated measures through the real judgement and gates."""

from __future__ import annotations

import datetime
import functools

import numpy as np
import pyarrow as pa

from pipelines.nightly.gates import accuracy, failures, fresh, tail
from pipelines.nightly.judgement import judge
from pipelines.nightly.outputs.results import Results
from pipelines.nightly.record import Night, Outcome, State
from tests.pipelines.nightly import simulated

START = datetime.datetime(2026, 5, 4, 3, 0, 0, tzinfo=datetime.UTC)
ALPHA = 0.01
FACTS = (("commit", "0a1b2c3"), ("numpy", "2.4.0"), ("BLAS kernel", "Haswell"))


@functools.cache  # nothing changes it
def results(fault=None, *, seed=0, poses=20, failing=(), waived=False, number=0, baseline="spring", facts=FACTS):
    """One night. fault: planted in equisolid, in both suites. failing: frames of perspective that fail anew."""
    pinned, views = (_pair(fault, seed + i, poses, failing if i == 0 else ()) for i in range(2))
    found = {"pinned": judge(*pinned, ALPHA, paired=True), "fresh": judge(*views, ALPHA, paired=True)}
    again = judge(*_pair(fault, seed + 2, poses, ()), ALPHA, paired=True)

    def accepted(*_):
        return waived

    outcomes = (
        Outcome("ran", State.PASSED, "every stage ran"),
        Outcome("data", State.PASSED, "the pinned suite is what it was"),
        accuracy.judge(found["pinned"], accepted),
        fresh.judge(found["fresh"], lambda: again, accepted),
        failures.judge(found["pinned"], None, accepted),
        tail.judge(*pinned, accepted),
    )
    started = START + datetime.timedelta(days=number)
    data = (("pinned", "0" * 64), ("fresh", f"{seed:064x}"))
    night = Night(f"{started:%Y%m%dT%H%M%SZ}-{number:08x}", started, "nightly", baseline, facts, data, outcomes)
    measures = {f"pinned {side}": table for side, table in zip(("old", "new"), pinned, strict=True)}
    measures |= {f"fresh {side}": table for side, table in zip(("old", "new"), views, strict=True)}
    return Results(night, {name: item.findings for name, item in found.items()}, ALPHA, measures)


def _pair(fault, seed, poses, failing):
    """Both sides' measures of the same pictures: nearly all of the scatter is common to both."""
    old = simulated.night(poses, np.random.default_rng(seed))
    new = simulated.night(poses, np.random.default_rng(seed), fault)
    failed = np.array(new["failed"].to_numpy(zero_copy_only=False))
    failed[list(failing)] = True  # the first rows are those of the detector in the first camera
    return old, new.set_column(new.schema.get_field_index("failed"), new.schema.field("failed"), pa.array(failed))

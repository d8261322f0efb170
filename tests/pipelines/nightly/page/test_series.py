"""What is followed over the nights, against a plain search of the findings."""

import dataclasses

import numpy as np

from pipelines.nightly.page.findings import Key, tonight
from pipelines.nightly.page.series import MOST_TRENDS, Nights, headlines
from tests.pipelines.nightly.page import synthetic
from tests.pipelines.nightly.page.test_findings import ROW


def test_each_night_has_its_own_numbers(tmp_path):
    history = synthetic.history(tmp_path, 72, 3)  # night 71 has no verdict and no findings
    ids = history.run_ids()
    findings = history.findings(ids)
    rows = findings.to_pylist()
    nights = Nights(findings, ids)
    for key in (Key("pinned", rows[0]["slice"], "corner_x"), Key("fresh", rows[-1]["slice"], rows[-1]["metric"])):
        own = {row["run_id"]: row for row in rows if (row["suite"], row["slice"], row["metric"]) == key}
        found = nights.of(key)
        for name in ("old", "new", "low", "high", "margin"):
            wanted = [own[run_id][name] if run_id in own else np.nan for run_id in ids]
            np.testing.assert_array_equal(getattr(found, name), wanted)
        assert found.worse.tolist() == [run_id in own and own[run_id]["verdict"] == "worse" for run_id in ids]
        assert np.isnan(found.new[70])
    assert nights.of(Key("pinned", rows[0]["slice"], "corner_x")).worse[-1]


def test_changes_and_headlines_are_followed(tmp_path):
    history = synthetic.history(tmp_path, 1, 10)
    rows = tonight(history.findings(history.run_ids()))
    found = headlines(rows, rows[:2])
    assert [row.key for row in found[:2]] == [row.key for row in rows[:2]]
    assert len(found) == MOST_TRENDS
    assert len({row.key.metric for row in found}) == MOST_TRENDS
    assert headlines([], []) == []


def test_a_headline_is_the_pinned_slice_nearest_to_its_margin():
    keys = [Key("pinned", "a", "corner_nees"), Key("pinned", "b", "corner_nees"), Key("fresh", "c", "corner_nees")]
    rows = [dataclasses.replace(ROW, key=key, effect=size) for key, size in zip(keys, (1.0, -2.0, 3.0), strict=True)]
    assert [row.key.slice for row in headlines(rows, [])] == ["b"]

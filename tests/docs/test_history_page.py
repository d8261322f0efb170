"""The documented queries answer their questions, on a history in which the answers are known."""

import dataclasses
import re

import duckdb
import pytest

from pipelines.nightly.accepted import Baseline, Waiver
from pipelines.nightly.history import FINDINGS, RUNS, History, finding_rows
from pipelines.nightly.measures import SCHEMA
from pipelines.nightly.metrics import METRICS
from pipelines.nightly.record import Timing
from tests.docs.documents import ROOT
from tests.pipelines.nightly import simulated
from tests.pipelines.nightly.whole_nights import FACTS, results
from tools import reference

TEXT = (ROOT / "docs" / "guide" / "history.md").read_text()
VIEWS, *QUERIES = re.findall(r"^```sql\n(.*?)^```", TEXT, flags=re.S | re.M)
NAMED = {query.splitlines()[0].removeprefix("-- "): query for query in QUERIES}

NIGHTS = 8
BAD = (4, 5)  # nights with a bias of the corners, which began with another NumPy
CHANGED = 6  # the baseline
DRIFT_PX = 0.00002  # a night, along y
SLICE = "typical/equisolid/edge-fit"
OTHER = (("commit", "0a1b2c3"), ("numpy", "2.5.0"), ("BLAS kernel", "Haswell"))


def _night(number):
    def plant(values):
        values["corner_y"] += DRIFT_PX * number
        if number in BAD:
            values["corner_x"] += 0.002

    night = results(
        plant,
        seed=7,
        number=number,
        failing=(3, 5) if number == NIGHTS - 1 else (),
        waived=number == NIGHTS - 1,
        baseline="spring" if number < CHANGED else "summer",
        facts=OTHER if number >= BAD[0] else FACTS,
    )
    speed = Timing("detect", 1.0 + number / 100.0, 1.0, 1.1, 17.0, 17.0 + number)
    return dataclasses.replace(night, night=dataclasses.replace(night.night, timings=(speed,)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with out/nights; in it also what a night is just writing, and what a killed one left."""
    folder = tmp_path_factory.mktemp("nights")
    history = History(folder / "out" / "nights")
    for number in range(NIGHTS):
        night = _night(number)
        history.append(night.night, night.findings, night.alpha, night.measures)
    for kind in ("runs", "findings", "measures"):
        (history.root / kind / ".tmp-host-1-0123-20260504.parquet").write_text("half")
    orphan = finding_rows("20991231T000000Z-00000000", _night(0).findings, 0.01)
    duckdb.from_arrow(orphan).write_parquet(str(history.root / "findings" / "20991231T000000Z-00000000.parquet"))
    return folder


@pytest.fixture
def ask(folder, monkeypatch):
    """Rows that a query of the page gives."""
    monkeypatch.chdir(folder)
    connection = duckdb.connect()
    connection.execute(VIEWS)
    return lambda name: connection.execute(NAMED[name]).fetchall()


def _number(run_id):
    return int(run_id.rpartition("-")[2], 16)


def test_every_query_is_tested():
    tested = set(re.findall(r'ask\("([a-z ]+)"\)', (ROOT / "tests" / "docs" / "test_history_page.py").read_text()))
    assert tested == NAMED.keys()
    assert len(NAMED) == len(QUERIES)


def test_the_trend_of_a_metric(ask):
    rows = ask("trend")
    assert len(rows) == NIGHTS
    assert [row[5] for row in rows] == ["worse" if number in BAD else "equal" for number in range(NIGHTS)]
    assert [row[1] for row in rows] == pytest.approx([0.002 * (number in BAD) for number in range(NIGHTS)], abs=1e-12)


def test_nights_that_were_not_fine(ask):
    rows = ask("not fine")
    assert [_number(row[0]) for row in rows] == sorted(BAD, reverse=True)
    assert all(row[1] == 1 and "corner_x in typical/equisolid" in row[2] for row in rows)


def test_how_often_gates_failed(ask):
    found = {row[:2]: row[2:] for row in ask("gates")}
    assert found["accuracy", "failed"][0] == found["fresh", "failed"][0] == len(BAD)
    assert _number(found["accuracy", "failed"][1]) == max(BAD)
    assert found["failures", "waived"][0] == 1
    assert {state for _, state in found} == {"failed", "waived"}


def test_when_the_baseline_changed(ask):
    assert [(_number(run), name) for run, name in ask("baseline")] == [(0, "spring"), (CHANGED, "summer")]


def test_what_else_changed(ask):
    assert [(_number(row[0]), *row[1:]) for row in ask("facts")] == [(BAD[0], "numpy", "2.4.0", "2.5.0")]


def test_slices_with_most_unproved(ask):
    assert ask("unproved") == []  # the same pictures: everything is equal
    night = results(lambda values: values.update(circle_x=values["circle_x"] * 3.0), poses=6, number=NIGHTS)
    rows = finding_rows(night.night.run_id, night.findings, night.alpha)
    connection = duckdb.connect()
    connection.register("findings", rows)
    assert connection.execute(NAMED["unproved"]).fetchall() == [(SLICE, 1, 7)]


def test_what_was_nearest_to_its_margin(ask):
    rows = ask("nearest")
    assert len(rows) == 10
    assert rows[0][:2] == (SLICE, "corner_y")
    assert rows[0][4] == pytest.approx(DRIFT_PX * (NIGHTS - 1) / METRICS["corner_y"].margin)


def test_the_smallest_visible_change_beside_the_margin(ask):
    rows = {row[0]: row[1:] for row in ask("visible")}
    assert rows.keys() == {name for name in METRICS if not name.endswith("_error")}  # those are of users' systems
    assert all((unit, margin) == (METRICS[name].unit, METRICS[name].margin) for name, (unit, _, margin) in rows.items())


def test_drift_against_one_baseline(ask):
    """The latest baseline has two nights, too few for a slope; with all nights under its name there are eight."""
    assert ask("drift") == []
    connection = duckdb.connect()
    connection.execute(VIEWS)
    connection.execute(
        "create or replace view runs as select * replace ('summer' as baseline) from "
        "read_parquet('out/nights/runs/[!.]*.parquet')"
    )
    rows = connection.execute(NAMED["drift"]).fetchall()
    assert rows[0][:2] in ((SLICE, "corner_x"), (SLICE, "corner_y"))
    slopes = {row[1]: row[2] for row in rows if row[0] == SLICE}
    assert slopes["corner_y"] == pytest.approx(DRIFT_PX)


def test_processor_times(ask):
    rows = ask("speed")
    assert [_number(row[0]) for row in rows] == list(reversed(range(NIGHTS)))
    last = NIGHTS - 1
    assert rows[0][1:] == ("detect", 1.0 + last / 100.0, 17.0, 17.0 + last)


def test_frames_that_failed(ask):
    assert ask("failed frames") == [("typical", "perspective", simulated.DETECTOR, frame) for frame in (3, 5)]


def test_the_reference_has_every_column_and_key():
    history, baselines = reference.history(), reference.baselines()
    for schema in (RUNS, FINDINGS, SCHEMA):
        for field in schema:
            assert f"| `{field.name}` | `{field.type}` | {field.metadata[b'meaning'].decode()}" in history
    for kind in (Baseline, Waiver):
        assert all(f"| `{field.name}` |" in baselines for field in dataclasses.fields(kind))

"""What the page says of a comparison."""

import dataclasses

import numpy as np
import pyarrow as pa
import pytest

from pipelines.nightly.gates import fresh
from pipelines.nightly.history import FINDINGS, finding_rows
from pipelines.nightly.judgement import judge
from pipelines.nightly.page.findings import Key, Row, most_changed, rounded, sensible, tonight
from tests.pipelines.nightly import simulated

ROW = Row(
    Key("pinned", "s", "corner_x"), "px", 20, 0.0001, 0.0022, 0.0021, 0.0019, 0.0023, 0.0005, 0.00055, 1e-9, "worse"
)


def test_a_change_in_its_unit():
    assert (ROW.change, ROW.shown_unit) == ("+0.0021 [+0.0019, +0.0023]", "px")
    assert (ROW.margin_text, ROW.visible_text) == ("±0.0005", "±0.00055")
    assert ROW.values(ROW.old, ROW.new) == ("0.0001", "0.0022")
    assert ROW.size == pytest.approx(4.2)


def test_an_interval_without_width_does_not_ask_for_digits():
    assert dataclasses.replace(ROW, low=ROW.effect, high=ROW.effect + 1e-18).change == "+0.0021 [+0.0021, +0.0021]"


@pytest.mark.parametrize(("unit", "shown"), [("log px^2", "px²"), ("1", "")])
def test_logs_are_shown_as_per_cent(unit, shown):
    ends = {name: float(np.log(value)) for name, value in {"effect": 1.22, "low": 1.2, "high": 1.24}.items()}
    numbers = {"margin": float(np.log(1.05)), "smallest_visible": float(np.log(1.055)), "old": 0.0, "new": np.log(1.22)}
    row = dataclasses.replace(ROW, unit=unit, **ends, **numbers)
    assert (row.change, row.shown_unit) == ("+22 [+20, +24]", "%")
    assert (row.margin_text, row.visible_text, row.value_unit) == ("±5", "±5.5", shown)
    assert row.values(row.old, row.new) == ("1.00", "1.22")


def test_small_values_have_an_exponent_and_changes_do_not():
    row = dataclasses.replace(ROW, unit="log px^2")
    assert row.values(float(np.log(2.35e-5)), float(np.log(2.86e-5))) == ("2.3e-05", "2.9e-05")
    assert rounded(0.00004, 0.0004, True) == "0.0000"


@pytest.mark.parametrize(
    ("value", "step", "text"),
    [
        (1234.5, 400.0, "1234"),
        (-0.02, 0.15, "-0.02"),
        (-1e-5, 0.004, "0.000"),
        (np.nan, 1.0, "\N{EN DASH}"),
        (3.0, 0.0, "3"),
        (2e9, 1.0, "2.0e+09"),
    ],
)
def test_no_digit_that_means_nothing(value, step, text):
    assert rounded(value, step) == text


def test_two_digits_of_what_is_known_exactly():
    shown = [sensible(value) for value in (0.0005, 4.9999999, 10.0, 123.4, np.inf)]
    assert shown == ["0.0005", "5", "10", "123", "\N{EN DASH}"]


def _tonight(*items):
    """Rows of (suite, slice, verdict, effect), whose old value is 0, or with a p of their own."""
    base = {name: getattr(ROW, name) for name in ("unit", "poses", "low", "high", "margin", "smallest_visible")}
    base |= {"run_id": "r", "metric": "corner_x", "old": 0.0}
    names = ("suite", "slice", "verdict", "effect", "p")
    rows = [base | dict(zip(names, (*item, 1e-9)[:5], strict=True)) | {"new": item[3]} for item in items]
    return tonight(pa.Table.from_pylist(rows, schema=FINDINGS))


def test_changes_come_first_and_the_largest_of_them():
    sizes = {"a": ("equal", 0.0), "b": ("worse", 0.002), "c": ("better", -0.1), "d": ("worse", -0.003)}
    rows = _tonight(*(("pinned", name, *item) for name, item in sizes.items()))
    assert [row.key.slice for row in rows] == ["d", "b", "c", "a"]


@pytest.mark.parametrize(
    ("second", "verdict"),
    [
        (None, "unconfirmed"),
        (("unproved", 0.002, 0.04), "worse"),  # one flagged metric: 5 % are enough
        (("unproved", 0.002, 0.06), "unconfirmed"),
        (("worse", 0.0004, 1e-9), "unconfirmed"),  # within the margin
        (("better", 0.0, 1e-9), "unconfirmed"),
    ],
)
def test_a_fresh_change_counts_once_a_second_look_confirms_it(second, verdict):
    looks = [("fresh", "a", "worse", 0.002), ("fresh", "b", "better", 0.002), ("fresh", "c", "equal", 0.0)]
    looks += [("confirming", "a", *second), ("confirming", "b", "better", 0.002)] if second else []
    rows = {row.key.slice: row for row in _tonight(*looks)}
    assert {name: row.verdict for name, row in rows.items()} == {"a": verdict, "b": "unconfirmed", "c": "equal"}
    assert (rows["a"].again is not None) == (verdict == "worse")


def test_what_is_confirmed_is_what_the_gate_believes():
    """The gate's own answer for the same two looks at a bias in one lens."""
    rng = np.random.default_rng(3)
    looks = [
        judge(simulated.night(20, rng), simulated.night(20, rng, simulated.corner_bias(0.002)), fresh.ALPHA, True)
        for _ in range(2)
    ]
    believed = fresh.judge(looks[0], lambda: looks[1], lambda *_: False).findings
    findings = {"fresh": looks[0].findings, "confirming": looks[1].findings}
    rows = tonight(finding_rows("r", findings, fresh.ALPHA))
    told = {row.key[1:] for row in rows if row.verdict == "worse"}
    assert told == {(item.slice, item.change.metric.name) for item in believed}
    assert told


def test_at_most_five_changes_and_each_metric_of_a_slice_once():
    every = [(suite, name, "worse", 0.002) for name in "abcdefg" for suite in ("pinned", "fresh", "confirming")]
    found = most_changed(_tonight(*every))
    assert len(found) == 5
    assert len({row.key.slice for row in found}) == 5
    assert most_changed(_tonight(("pinned", "a", "unproved", 0.002))) == []

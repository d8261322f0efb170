"""What the page says of a comparison."""

import dataclasses

import numpy as np
import pyarrow as pa
import pytest

from pipelines.nightly.history import FINDINGS
from pipelines.nightly.page.findings import Key, Row, most_changed, rounded, sensible, tonight

ROW = Row(Key("pinned", "s", "corner_x"), "px", 20, 0.0001, 0.0022, 0.0021, 0.0019, 0.0023, 0.0005, 0.00055, "worse")


def test_a_change_in_its_unit():
    assert (ROW.change, ROW.shown_unit) == ("+0.0021 [+0.0019, +0.0023]", "px")
    assert (ROW.margin_text, ROW.visible_text) == ("±0.0005", "±0.00055")
    assert ROW.values(ROW.old, ROW.new) == ("0.0001", "0.0022")
    assert ROW.size == pytest.approx(4.2)


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


def _tonight(items, fresh_state="passed"):
    base = {
        name: getattr(ROW, name)
        for name in ("unit", "poses", "old", "new", "effect", "low", "high", "margin", "smallest_visible")
    }
    rows = [
        base
        | {
            "run_id": "r",
            "p": 0.0,
            "suite": suite,
            "slice": name,
            "metric": "corner_x",
            "verdict": verdict,
            "effect": effect,
        }
        for suite, name, verdict, effect in items
    ]
    return tonight(pa.Table.from_pylist(rows, schema=FINDINGS), [{"gate": "fresh", "state": fresh_state}])


def test_changes_come_first_and_the_largest_of_them():
    rows = _tonight(
        [
            ("pinned", "a", "equal", 0.0),
            ("pinned", "b", "worse", 0.002),
            ("pinned", "c", "better", -0.1),
            ("pinned", "d", "worse", -0.003),
        ]
    )
    assert [row.key.slice for row in rows] == ["d", "b", "c", "a"]


@pytest.mark.parametrize(("state", "verdict"), [("passed", "unconfirmed"), ("failed", "worse"), ("waived", "worse")])
def test_a_fresh_change_counts_once_the_gate_confirms_it(state, verdict):
    rows = _tonight([("fresh", "a", "worse", 0.002), ("fresh", "b", "better", 0.002)], state)
    assert [row.verdict for row in rows] == [verdict, "unconfirmed"]


def test_at_most_five_changes_and_each_metric_of_a_slice_once():
    both = [(suite, name, "worse", 0.002) for name in "abcdefg" for suite in ("pinned", "fresh")]
    found = most_changed(_tonight(both, "failed"))
    assert len(found) == 5
    assert len({row.key.slice for row in found}) == 5
    assert most_changed(_tonight([("pinned", "a", "unproved", 0.002)])) == []

"""summary.md: short whatever the night holds, and no text of the night is taken for markup."""

import dataclasses
import re

from pipelines.nightly.judgement import Finding
from pipelines.nightly.outputs import summary
from pipelines.nightly.record import Exit, Outcome, State
from tests.pipelines.nightly import simulated
from tests.pipelines.nightly.whole_nights import results

FAULT = simulated.corner_bias(0.002)


def _everything(values):
    """Each metric is worse."""
    for name in values:
        values[name] = values[name] * 2.0 + 1.0


def _changes(text):
    return [line for line in text.splitlines() if line.startswith("- ")]


def test_a_bad_night_says_what_changed():
    night = results(FAULT)
    text = summary.text(night, "https://ci/report.html")
    assert text.startswith(
        "## Nightly nightly: worse\n\naccuracy: corner\\_x in typical/equisolid/edge-fit is worse by"
    )
    assert "Exit code 1, run 20260504T030000Z-00000000, baseline spring. [Report](<https://ci/report.html>)" in text
    assert "| accuracy | **failed** | corner\\_x in" in text
    assert "| tail | not run |" in text
    first = _changes(text)[0]
    assert re.search(
        r"\+0\.002 .*, margin 0\.0005, smallest visible [\d.e-]+ \((fresh|pinned) suite, 20 poses\)", first
    )


def test_a_quiet_night_says_so():
    text = summary.text(results(), "report.html")
    assert "## Nightly nightly: fine" in text
    assert "No metric is shown to have changed." in text
    assert _changes(text) == []


def test_five_changes_and_how_many_more():
    night = results(_everything)
    lines = _changes(summary.text(night, "report.html"))
    assert len(lines) == 6
    assert lines[5] == f"- {len(night.changes()) - 5} more"


def test_texts_are_no_markup_and_stay_in_their_cell():
    outcome = Outcome("ran|", State.FAILED, "a | b\n\n# c <img src=x> *d* `e` [f](g)", Exit.COULD_NOT_RUN)
    night = results()
    text = summary.text(dataclasses.replace(night, night=dataclasses.replace(night.night, outcomes=(outcome,))), "r")
    (row,) = [line for line in text.splitlines() if line.startswith("| ran")]
    assert row == ("| ran\\| | **failed** | a \\| b # c &lt;img src=x&gt; \\*d\\* \\`e\\` \\[f\\](g) |")
    assert "## Nightly nightly: could not run" in text


def test_the_largest_night_is_below_64_kb():
    """Ten thousand gates and as many changes, with texts of the characters that grow most."""
    worst = "&\U0001f600" * 50_000
    night = results(_everything)
    finding = next(item for _, item in night.changes())
    finding = Finding(worst, finding.change, finding.verdict)
    outcomes = tuple(Outcome(worst, State.FAILED, worst, Exit.WORSE) for _ in range(10_000))
    record = dataclasses.replace(night.night, outcomes=outcomes, run_id=worst, recipe=worst, baseline=worst)
    huge = dataclasses.replace(night, night=record, findings={"pinned": [finding] * 10_000})
    size = len(summary.text(huge, "report.html").encode())
    assert size < 64_000

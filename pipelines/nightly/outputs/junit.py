"""junit.xml: a test suite for each gate. Gates that judge lens by lens have a case for each, the others one case.

The names of the cases are the same on every night, so that a build server can follow them. How a gate ended becomes:

- failed: a `failure`; an `error` if there was no verdict or the night could not run
- waived, not run: `skipped`
- passed, changed, warned: a case that passes, since the night's exit code does not change

The reason is the message of the failure, error or skip, and the case's output otherwise.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator

from junitparser import Error, Failure, JUnitXml, Skipped, TestCase, TestSuite

from pipelines.nightly.gates import accuracy, failures, fresh
from pipelines.nightly.outputs.results import Results, lens_of
from pipelines.nightly.record import Exit, Outcome, State

LENS_BY_LENS = (accuracy.GATE, fresh.GATE, failures.GATE)
WHOLE = "night"  # the case of a gate that judges everything together
NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # what XML 1.0 cannot hold


def text(results: Results) -> str:
    """The document."""
    document, lenses = JUnitXml("nightly"), results.lenses()
    for outcome in results.night.outcomes:
        suite = TestSuite(_clean(outcome.gate))
        suite.timestamp = results.night.started.isoformat()
        for name in ("run_id", "recipe", "baseline"):
            suite.add_property(name, _clean(getattr(results.night, name)))
        for name, state, reason in _cases(outcome, results, lenses):
            suite.add_testcase(_case(results.night.recipe, outcome, name, state, reason))
        document.add_testsuite(suite)
    document.update_statistics()
    return document.tostring().decode()


def _cases(outcome: Outcome, results: Results, lenses: list[str]) -> Iterator[tuple[str, State, str]]:
    """Name, state and reason of each case of a gate."""
    if outcome.gate not in LENS_BY_LENS or not lenses:
        yield WHOLE, outcome.state, outcome.sentence
        return
    reasons = _reasons(outcome, results)
    for lens in lenses:
        if not reasons or lens in reasons:  # a gate that names no lens means all of them
            yield lens, outcome.state, "\n".join(reasons.get(lens, [outcome.sentence]))
        else:
            yield lens, State.PASSED, "the gate names nothing of this lens"
    if reasons.keys() - set(lenses):
        yield WHOLE, outcome.state, outcome.sentence


def _reasons(outcome: Outcome, results: Results) -> dict[str, list[str]]:
    """Lens to why it is named, of the findings and frames that decided the gate."""
    reasons = defaultdict(list)
    for item in outcome.findings:
        reasons[lens_of(item.slice)].append(accuracy.describe([item]))
    for suite, frame in outcome.frames:
        for lens in results.lenses_of_frame(suite, frame) or {""}:
            reasons[lens].append(f"frame {frame} of the {suite} suite")
    return dict(reasons)


def _case(recipe: str, outcome: Outcome, name: str, state: State, reason: str) -> TestCase:
    case = TestCase(_clean(name), classname=_clean(f"nightly.{recipe}.{outcome.gate}"))
    told = _clean(f"{state}: {reason}")
    if state is State.FAILED:
        kind = Failure if outcome.exit is Exit.WORSE else Error
        result = kind(told.partition("\n")[0], outcome.exit.name.lower())
        result.text = told
        case.result = [result]
    elif state in (State.WAIVED, State.NOT_RUN):
        case.result = [Skipped(told)]
    else:
        case.system_out = told
    return case


def _clean(text: str) -> str:
    return NOT_XML.sub("\ufffd", text)

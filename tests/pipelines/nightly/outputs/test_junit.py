"""junit.xml: a build server sees the same cases every night, red exactly where a gate failed."""

import dataclasses

import pytest
from junitparser import Error, Failure, JUnitXml, Skipped

from pipelines.nightly.outputs import junit
from pipelines.nightly.record import Exit, Outcome, State
from tests.pipelines.nightly import simulated
from tests.pipelines.nightly.whole_nights import results

FAULT = simulated.corner_bias(0.002)
LENSES = [f"typical/{camera}" for camera in sorted(simulated.CAMERAS)]


def _cases(night):
    """(gate, case) to the case, of the document read again."""
    document = JUnitXml.fromstring(junit.text(night).encode())
    return {(suite.name, case.name): case for suite in document for case in suite}


def _red(night):
    return {key for key, case in _cases(night).items() if any(isinstance(r, Failure | Error) for r in case.result)}


def _with(night, *outcomes):
    return dataclasses.replace(night, night=dataclasses.replace(night.night, outcomes=outcomes))


def test_a_quiet_night_is_green_and_every_gate_has_its_cases():
    cases = _cases(results())
    expected = {(gate, lens) for gate in ("accuracy", "fresh", "failures") for lens in LENSES}
    assert cases.keys() == expected | {(gate, "night") for gate in ("ran", "data", "tail")}
    assert _red(results()) == set()


def test_the_cases_are_the_same_on_a_bad_night():
    assert _cases(results(FAULT, failing=(3,))).keys() == _cases(results()).keys()


def test_a_fault_is_red_in_its_lens_with_the_reason():
    night = results(FAULT)
    assert _red(night) == {("accuracy", "typical/equisolid"), ("fresh", "typical/equisolid")}
    (result,) = _cases(night)["accuracy", "typical/equisolid"].result
    assert isinstance(result, Failure)
    assert "corner_x in typical/equisolid/edge-fit is worse by +0.002" in result.message
    assert result.type == "worse"


def test_a_frame_that_fails_anew_is_red_in_its_lens():
    night = results(failing=(3,))
    assert _red(night) == {("failures", "typical/perspective")}
    (result,) = _cases(night)["failures", "typical/perspective"].result
    assert "frame 3 of the pinned suite" in result.text


@pytest.mark.parametrize(
    ("code", "kind"), [(Exit.WORSE, Failure), (Exit.NO_VERDICT, Error), (Exit.COULD_NOT_RUN, Error)]
)
def test_no_verdict_is_an_error_and_no_failure(code, kind):
    case = _cases(_with(results(), Outcome("data", State.FAILED, "other pictures", code)))["data", "night"]
    assert [type(result) for result in case.result] == [kind]
    assert case.result[0].message == "failed: other pictures"


@pytest.mark.parametrize("state", [State.WAIVED, State.NOT_RUN])
def test_waived_and_not_run_are_skipped_with_the_reason(state):
    case = _cases(_with(results(), Outcome("speed", state, "known since May")))["speed", "night"]
    assert [type(result) for result in case.result] == [Skipped]
    assert case.result[0].message == f"{state}: known since May"


@pytest.mark.parametrize("state", [State.PASSED, State.CHANGED, State.WARNED])
def test_what_does_not_fail_passes_and_tells(state):
    case = _cases(_with(results(), Outcome("tail", state, "as ever")))["tail", "night"]
    assert case.result == []
    assert case.system_out == f"{state}: as ever"


@pytest.mark.parametrize("gate", ["accuracy", "failures", "speed"])
@pytest.mark.parametrize("frames", [(), (("pinned", 999),), (("elsewhere", 1),)])
def test_a_gate_that_failed_is_never_all_green(gate, frames):
    """Also if it names no lens, or frames that no table of measures holds, and without measures at all."""
    night = _with(results(), Outcome(gate, State.FAILED, "bad", Exit.WORSE, frames=frames))
    assert _red(night)
    assert _red(dataclasses.replace(night, measures={}, findings={}))


def test_texts_that_xml_cannot_hold_are_replaced():
    case = _cases(_with(results(), Outcome("ran", State.FAILED, 'a\0b <&"> \ud7ff \x1b[1m', Exit.WORSE)))[
        "ran", "night"
    ]
    assert case.result[0].message == 'failed: a\ufffdb <&"> \ud7ff \ufffd[1m'

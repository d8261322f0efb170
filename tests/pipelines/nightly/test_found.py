"""An error in the middle of a night is the outcome of its gate, and the night goes on."""

import pytest

from datasets.errors import UserError
from pipelines.nightly.found import Found
from pipelines.nightly.other_code import OtherCodeError
from pipelines.nightly.record import Exit, Outcome, State


@pytest.mark.parametrize("error", [UserError("gone"), OtherCodeError("gone"), RuntimeError("gone")])
def test_an_error_fails_the_gate_that_was_at_work(error, capfd):
    found = Found()
    with found.at_gate("ran"):
        found.outcomes.append(Outcome("ran", State.PASSED, "all ran"))
    with found.at_gate("speed"):
        raise error
    assert [(item.gate, item.state, item.exit) for item in found.outcomes] == [
        ("ran", State.PASSED, Exit.FINE),
        ("speed", State.FAILED, Exit.COULD_NOT_RUN),
    ]
    assert found.outcomes[1].sentence.endswith("gone")
    assert not found.stopped()
    expected = isinstance(error, UserError | OtherCodeError)
    assert ("Traceback" in capfd.readouterr().err) is not expected  # of a defect one wants to know the place


@pytest.mark.parametrize(("gate", "stops"), [("ran", True), ("data", True), ("replay", False), ("fresh", False)])
def test_what_the_later_gates_need_stops_the_night(gate, stops):
    found = Found()
    with found.at_gate(gate):
        raise UserError("gone")
    assert found.stopped() is stops


def test_stopping_by_hand_is_no_outcome():
    found = Found()
    with pytest.raises(KeyboardInterrupt), found.at_gate("ran"):
        raise KeyboardInterrupt
    assert found.outcomes == []

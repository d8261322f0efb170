"""What a night has found so far, gate by gate."""

from __future__ import annotations

import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import pyarrow as pa

from datasets.errors import UserError
from pipelines.nightly.gates.regenerate import Again
from pipelines.nightly.judgement import Finding
from pipelines.nightly.other_code import OtherCodeError
from pipelines.nightly.record import Exit, Outcome, State, Timing

RAN, BASELINE = "ran", "baseline"
OTHERS_NEED = (RAN, BASELINE, "data", "regenerate")  # without these, later gates would compare other things


@dataclass(slots=True)
class Found:
    """What a night has found so far."""

    outcomes: list[Outcome] = field(default_factory=list)
    findings: dict[str, Sequence[Finding]] = field(default_factory=dict)  # by suite
    measures: dict[str, pa.Table] = field(default_factory=dict)  # by suite and side
    data: dict[str, str] = field(default_factory=dict)  # what was read, and its digest
    timings: list[Timing] = field(default_factory=list)
    again: list[Again] = field(default_factory=list)  # pinned frames, rendered again

    def stopped(self) -> bool:
        """Whether a gate has failed that the later ones need."""
        return any(item.state is State.FAILED and item.gate in OTHERS_NEED for item in self.outcomes)

    @contextmanager
    def at_gate(self, gate: str) -> Iterator[None]:
        """Work on a gate: an error becomes its outcome, so that a night always ends with an outcome of each gate.

        Without this a defect of the candidate would end the process with Python's exit code 1, which means worse.
        """
        try:
            yield
        except (UserError, OtherCodeError) as error:
            self._failed(gate, str(error))
        except Exception as error:  # a defect, of the candidate as likely as not: its place is needed, too
            traceback.print_exc()
            self._failed(gate, f"{type(error).__name__}: {error}")

    def _failed(self, gate: str, told: str) -> None:
        self.outcomes.append(Outcome(gate, State.FAILED, f"could not run: {told}", Exit.COULD_NOT_RUN))

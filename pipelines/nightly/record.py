"""What one night leaves: the gates with their outcomes, and the facts that a later reader needs to believe them."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import IntEnum, StrEnum

from pipelines.nightly.judgement import Finding


class Exit(IntEnum):
    """Exit codes of `nightly`."""

    FINE = 0
    WORSE = 1
    USAGE = 2
    NO_VERDICT = 3  # the data or the machine changed, so that numbers cannot be compared
    COULD_NOT_RUN = 4


class State(StrEnum):
    """How a gate ended."""

    PASSED = "passed"
    CHANGED = "changed"  # something differs, and that is not bad by itself
    WARNED = "warned"  # not shown to be worse, nor to be equal
    WAIVED = "waived"  # failed, and somebody has accepted it, with a reason
    FAILED = "failed"
    NOT_RUN = "not run"  # an earlier gate left nothing to judge, or the suite has no such part


@dataclass(frozen=True, slots=True)
class Outcome:
    """One gate of one night."""

    gate: str
    state: State
    sentence: str  # what was found, in one sentence
    exit: Exit = Exit.FINE  # what a FAILED gate makes of the night
    findings: tuple[Finding, ...] = ()  # of the slices and metrics that decided, the largest first
    frames: tuple[tuple[str, int], ...] = ()  # suite and frame_id to look at, the worst first


@dataclass(frozen=True, slots=True)
class Timing:
    """Processor time of one stage, the candidate's over the baseline's."""

    stage: str
    ratio: float  # median over the pairs of turns
    low: float  # the smallest and the largest ratio of a pair
    high: float
    old_ms: float  # a frame
    new_ms: float


@dataclass(frozen=True, slots=True)
class Night:
    """One run of `nightly`."""

    run_id: str  # sorts by time, unique also between machines
    started: datetime  # UTC
    recipe: str
    baseline: str
    facts: tuple[tuple[str, str], ...]  # commit, versions, processor, BLAS kernel, waivers that have ended
    data: tuple[tuple[str, str], ...]  # what was read, and its content hash
    outcomes: tuple[Outcome, ...]
    timings: tuple[Timing, ...] = ()  # of gate `speed`

    @property
    def exit(self) -> Exit:
        """The exit code: could not run before no verdict before worse."""
        failed = [outcome.exit for outcome in self.outcomes if outcome.state is State.FAILED]
        return max(failed, default=Exit.FINE)

    @property
    def sentence(self) -> str:
        """The whole night in one sentence."""
        for outcome in self.outcomes:
            if outcome.state is State.FAILED and outcome.exit is self.exit:
                return f"{outcome.gate}: {outcome.sentence}"
        count = sum(outcome.state is State.WARNED for outcome in self.outcomes)
        warned = f"; {count} gate{'s' if count > 1 else ''} with a warning" if count else ""
        return f"fine: nothing is shown to be worse than {self.baseline}{warned}"

"""Giving a reader what hypothesis thinks of, in rounds until a time is over, and telling how many examples it had."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import FrameType
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis.strategies import SearchStrategy

SECONDS = float(os.environ.get("FUZZ_SECONDS", "60"))
FEW, ROUND = 60, 500  # examples in the tier of every commit, and of a round
EACH_S = 30.0  # between two lines that tell how far it is


@dataclass(frozen=True)
class Fuzzing:
    """How much is done, and where it is told."""

    name: str
    examples: int  # of a round
    seconds: float  # that the rounds may take, reading alone; 0 for a single one
    tell: Callable[[str], None]

    def __call__(
        self, strategy: SearchStrategy[Any], read: Callable[[Any], object], errors: Any, examples: int | None = None
    ) -> None:
        """Give examples to a reader; no other error comes out of it. SIGTERM ends it as the end of its time does.

        examples: of a single round, for a slow reader.
        """
        begin = told = time.monotonic()
        count, stopped = 0, False
        with _stopped_by_sigterm() as signals:

            def once(value: Any) -> None:
                nonlocal count, stopped, told
                now = time.monotonic()
                stopped = bool(signals) or 0.0 < self.seconds < now - begin
                if stopped:
                    return
                with contextlib.suppress(errors):
                    read(value)
                count += 1
                if self.seconds and now - told > EACH_S:
                    self.tell(f"{self.name}: {count} examples in {now - begin:.0f} s, going on")
                    told = now

            try:
                while count == 0 or (self.seconds and not stopped):
                    self._round(strategy, once, examples)
            finally:
                if self.seconds:
                    self.tell(f"{self.name}: {count} examples in {time.monotonic() - begin:.0f} s")
        if signals:
            pytest.exit("ended by SIGTERM", returncode=128 + signal.SIGTERM)

    def _round(self, strategy: SearchStrategy[Any], once: Callable[[Any], None], examples: int | None) -> None:
        # Making a failure simpler may take longer than all the rest.
        phases = [phase for phase in Phase if not self.seconds or phase != Phase.shrink]
        most = self.examples if examples is None or self.seconds else examples
        rules = settings(
            max_examples=most, deadline=None, database=None, suppress_health_check=list(HealthCheck), phases=phases
        )
        rules(given(strategy)(once))()


@contextlib.contextmanager
def _stopped_by_sigterm() -> Iterator[list[int]]:
    """Signals that came in the body, which goes on all the same."""
    came: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        came.append(number)

    before = signal.signal(signal.SIGTERM, note)
    try:
        yield came
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.fixture(params=[pytest.param(0.0, id="few"), pytest.param(SECONDS, id="long", marks=pytest.mark.slow)])
def fuzz(request: pytest.FixtureRequest, capfd: pytest.CaptureFixture[str]) -> Fuzzing:
    """A few examples, or for a time with its counts on the terminal, also if the test is ended early."""

    def tell(text: str) -> None:
        with capfd.disabled():
            print(f"\n{text}", file=sys.stderr, flush=True)

    return Fuzzing(request.node.name, ROUND if request.param else FEW, request.param, tell)

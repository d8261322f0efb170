"""Nights of real noise draws through the product's own gates, with a fault in the candidate or without.

On the *same pictures* candidate and baseline see the same noise, as in every night of the product. With *other noise*
they see the same poses in different pictures: as far apart as two systems of the same accuracy can be.
"""

from __future__ import annotations

import contextlib
import datetime
from dataclasses import dataclass
from unittest import mock

import numpy as np

from pipelines.nightly import judgement
from pipelines.nightly.gates import accuracy, failures, fresh, speed, tail
from pipelines.nightly.judgement import judge_slices
from pipelines.nightly.other_code import ROOT, Code
from pipelines.nightly.record import Exit, Night, State
from pipelines.nightly.suites import FRESH_POSES
from tests.pipelines.nightly.studies.reading import Reading, Views

SAME, OTHER = "same pictures", "other noise"
# Relative scatter of one stage's processor time in one turn. The gate's ratio, a median over four pairs, then scatters
# by 1 %, as measured in real nights.
TURN_SCATTER = 0.0175


@dataclass(frozen=True, slots=True)
class Planted:
    """A fault with its size; none of either is a quiet night."""

    fault: object = None
    size: float = 0.0
    slower: float = 0.0  # share by which detection takes longer


class Stage:
    """One night that is judged again with every fault: its pictures, and what does not depend on the fault.

    noise: SAME or OTHER. Comparisons of two slices that no fault touches are made once.
    """

    def __init__(self, pool, poses, noise, seed):
        self.rng, self.pairs, self.compared = np.random.default_rng(seed), [], {}
        for count in (poses, FRESH_POSES, FRESH_POSES):  # pinned, fresh, and the second look
            views = Views.drawn(pool, count, self.rng)
            self.pairs.append((views, views if noise == SAME else views.with_other_noise(self.rng)))
        self.seed = seed

    def night(self, planted):
        """The night with a fault in the candidate."""
        rng = np.random.default_rng((*self.seed, 1))
        with mock.patch.multiple(judgement, _changes=self._once(judgement._changes)):
            sides, pinned = self._judged(0, planted, accuracy.ALPHA, rng)
            tonight = self._judged(1, planted, fresh.ALPHA, rng)[1]
            return _night(
                accuracy.judge(pinned, nobody),
                fresh.judge(tonight, lambda: self._judged(2, planted, fresh.ALPHA, rng)[1], nobody),
                failures.judge(pinned, tonight, nobody),
                tail.judge_slices(*sides, nobody),
                speed.judge(timings(rng, planted.slower), nobody),
            )

    def _judged(self, which, planted, alpha, rng):
        old, new = (Reading(views) for views in self.pairs[which])
        if planted.fault is not None:
            planted.fault.plant(new, planted.size, rng)
        sides = old.slices(), new.slices()
        return sides, judge_slices(*sides, alpha, paired=True)

    def _once(self, real):
        kept = {id(item) for pair in self.pairs for views in pair for own in views.clean.values() for item in own}

        def changes(old, new, paired):
            if id(old) not in kept or id(new) not in kept:
                return real(old, new, paired)
            key = id(old), id(new)
            if key not in self.compared:
                self.compared[key] = real(old, new, paired)
            return self.compared[key]

        return changes


def run(pool, poses, planted, noise, seed):
    """One night of its own."""
    return Stage(pool, poses, noise, seed).night(planted)


def pinned_only(old, new):
    """A night of the gates that compare with the frozen baseline's numbers, (slices, slices)."""
    judged = judge_slices(old, new, accuracy.ALPHA, paired=True)
    return _night(
        accuracy.judge(judged, nobody), failures.judge(judged, None, nobody), tail.judge_slices(old, new, nobody)
    )


def nobody(*_):
    """No failure is waived."""
    return False


def failed(night):
    """The gates that failed."""
    return [outcome for outcome in night.outcomes if outcome.state is State.FAILED]


def is_worse(night):
    """Whether the night ends with the exit code of something worse."""
    return night.exit is Exit.WORSE


def timings(rng, slower=0.0):
    """What gate `speed` makes of simulated processor times. slower: share by which the candidate detects longer."""

    def turn(factor):
        detect, estimate = rng.normal(1.0, TURN_SCATTER, 2)
        return {"detect": 0.3 * detect * factor, "estimate": 0.1 * estimate}

    factors = iter((1.0, 1.0 + slower))
    running = contextlib.nullcontext
    with mock.patch.multiple(speed, _running=lambda *_: running(next(factors)), _turn=turn):
        return speed.time_both(Code(ROOT), Code(ROOT), (ROOT, ROOT), 20)


def _night(*outcomes):
    started = datetime.datetime(2026, 5, 4, tzinfo=datetime.UTC)
    return Night("", started, "nightly", "spring", (), (), outcomes)

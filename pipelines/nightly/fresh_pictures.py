"""The fresh pictures, read by the candidate and by the baseline's code."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pyarrow as pa

from pipelines.nightly import suites
from pipelines.nightly.accepted import Baseline
from pipelines.nightly.desk import Desk
from pipelines.nightly.found import Found
from pipelines.nightly.gates import fresh
from pipelines.nightly.judgement import Judgement, judge
from pipelines.nightly.reading import Frozen
from pipelines.nightly.systems import Systems, key_of


@dataclass(frozen=True, slots=True)
class _Sides:
    """What both codes estimate."""

    frozen: Frozen
    systems: Systems


def judge_fresh(desk: Desk, baseline: Baseline, found: Found) -> Judgement:
    """Compare on tonight's pictures, and on others what looked worse there; the outcome is added to `found`.

    Raises:
        OtherCodeError: one of the codes failed.
        UserError: the baseline's code is gone.
    """
    frozen = desk.frozen(baseline)
    known = set(found.measures[f"{suites.PINNED} old"]["system"].to_pylist())
    sides = _Sides(frozen, _common(desk.request.systems, frozen, known))
    first = _compare(desk, sides, suites.FRESH, desk.request.seed, found)

    def again() -> Judgement:
        return _compare(desk, sides, suites.CONFIRMING, desk.request.seed + suites.CONFIRMING_SEED, found)

    outcome = fresh.judge(first, again, lambda *what: desk.waived(fresh.GATE, *what))
    sentence = "; ".join((outcome.sentence, *_left_out(desk.request.systems, sides.systems)))
    found.outcomes.append(replace(outcome, sentence=sentence))
    return first


def _common(systems: Systems, frozen: Frozen, known: set[str]) -> Systems:
    """What the baseline's code can estimate, too: ours, named solvers that it knows, functions with a copy."""
    settings = tuple(item for item in systems.settings if item in suites.READ or key_of(item) in known)
    functions = tuple(item for item in systems.functions if item in frozen.functions)
    return replace(systems, settings=settings, functions=functions, files=())


def _left_out(asked: Systems, read: Systems) -> list[str]:
    """Sentences about what is judged on the pinned pictures only."""
    of_baseline = [item.solver for item in asked.settings if item not in read.settings]
    of_baseline += [item.name for item in asked.functions if item not in read.functions]
    told = [f"without {name}, which the baseline has no code of" for name in of_baseline]
    return told + [f"without {item.system.name}, whose poses are of the pinned pictures" for item in asked.files]


def _compare(desk: Desk, sides: _Sides, kind: str, seed: int, found: Found) -> Judgement:
    tables: tuple[list[pa.Table], list[pa.Table]] = ([], [])
    for suite in suites.suites(kind, desk.request.recipe, desk.request.regimes, seed):
        pictures = suite.make(desk.work / suite.name, desk.engine, desk.console)
        found.data[suite.name] = suites.pictures_digest(pictures)
        systems, folder = sides.systems, desk.work / suite.name
        before = sides.frozen.read(pictures, folder.with_name(f"{suite.name}-old"), systems.settings, systems.limit_s)
        after = desk.here.read(pictures, folder.with_name(f"{suite.name}-new"), systems)
        for table, reading in zip(tables, (before, after), strict=True):
            table.append(reading.measures)
    old, new = (pa.concat_tables(side) for side in tables)
    found.measures |= {f"{kind} old": old, f"{kind} new": new}
    judged = judge(old, new, fresh.ALPHA, paired=True)
    found.findings[kind] = judged.findings
    return judged

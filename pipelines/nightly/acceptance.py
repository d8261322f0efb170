"""What a person accepts: a run as the new baseline, or one failure of a run."""

from __future__ import annotations

import datetime
import getpass
from pathlib import Path

from datasets.errors import UserError
from pipelines.nightly import baselines, suites
from pipelines.nightly.accepted import Baseline, Waiver
from pipelines.nightly.baselines import FILE_NAME
from pipelines.nightly.history import History
from pipelines.nightly.other_code import freeze
from pipelines.nightly.systems import frozen_of


def accept_baseline(root: Path, run: str, reason: str, by: str | None) -> str:
    """Make a run the baseline of its recipe, and keep a copy of this code; the baseline's name.

    Raises:
        UserError: no such run, one that could not run, one of other code than this, a copy of a user's function that is
            gone, or the disk refuses.
    """
    history = History(root)
    found = history.run(run)
    known, measures = _mapping(found["data"]), _mapping(found["measures"])
    if f"{suites.PINNED} new" not in measures:
        told = "did not get through the pinned pictures, so it has nothing to compare with"
        raise UserError(f"run {found['run_id']} {told}; accept another run")
    code = freeze(root / "code")
    if known.get("code") != code.name:
        told = f"run {found['run_id']} was made by other code than this"
        raise UserError(f"{told}; run `nightly run` again and accept that run, so that its code can be kept")
    entry = Baseline(
        name=found["run_id"],
        recipe=found["recipe"],
        checkout=code.relative_to(root),
        commit=_mapping(found["facts"]).get("commit", "unknown"),
        pinned_data=known[suites.PINNED],
        run=found["run_id"],
        measures={suites.PINNED: measures[f"{suites.PINNED} new"]},
        accepted_by=by or getpass.getuser(),
        accepted_on=datetime.date.today(),
        reason=reason,
        systems=_systems(root, known),
    )
    baselines.accept(root / FILE_NAME, entry)
    return entry.name


def _systems(root: Path, known: dict[str, str]) -> dict[str, Path]:
    """Each of a user's functions in a run with its frozen copy, as seen from the history's folder."""
    found = {name: Path("code") / copy for name, copy in frozen_of(known)}
    for name, folder in found.items():
        if not (root / folder).is_dir():
            told = f"the copy of {name} is not in {root / folder} any more"
            raise UserError(f"{told}; run `nightly run` again and accept that run, so that its code can be kept")
    return found


def waive(
    root: Path,
    run: str,
    *,
    gate: str,
    slice: str | None,
    metric: str | None,
    frame: int | None,
    reason: str,
    by: str | None,
    until: str | None,
) -> str:
    """Accept one failure of a run until a day, or for good; what was waived, in words.

    Raises:
        UserError: no such run, a gate that did not fail in it, no date, or keys that the gate does not take.
    """
    found = History(root).run(run)
    failed = [item["gate"] for item in found["gates"] if item["state"] == "failed"]
    if gate not in failed:
        told = ", ".join(failed) or "none"
        raise UserError(f"gate {gate!r} did not fail in run {found['run_id']}; those that did: {told}")
    try:
        entry = Waiver(
            gate=gate,  # pyright: ignore[reportArgumentType]  it is one of a run's gates
            slice=slice or "",
            metric=metric,
            frame=frame,
            reason=reason,
            by=by or getpass.getuser(),
            until=None if until is None else datetime.date.fromisoformat(until),
            run=found["run_id"],
        )
    except ValueError as error:
        raise UserError(f"{error}") from None
    if slice is None:
        raise UserError(f"a waiver of gate {gate} needs the --slice that failed, as the gate's sentence names it")
    baselines.accept(root / FILE_NAME, entry)
    what = metric or (f"frame {frame}" if frame is not None else "time")
    return f"{what} in {slice} at gate {gate}" + (f", until {until}" if until else "")


def _mapping(pairs: list[dict[str, str]]) -> dict[str, str]:
    return {item["name"]: item["value"] for item in pairs}

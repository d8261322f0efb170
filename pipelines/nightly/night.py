"""One night from beginning to end: pictures, what both codes read in them, the gates in their order."""

from __future__ import annotations

import datetime
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pyarrow as pa
from rich.console import Console

from datasets.errors import UserError
from datasets.store.atomic import own_name
from datasets.store.dataset import Dataset
from datasets.store.digest import combined_digest
from datasets.store.lock import HeldError, hold
from pipelines.engines.local import LocalEngine
from pipelines.machine import provenance
from pipelines.nightly import suites
from pipelines.nightly.accepted import Baseline
from pipelines.nightly.baselines import FILE_NAME, Baselines, load
from pipelines.nightly.gates import accuracy, data, failures, fresh, regenerate, replay, speed, tail
from pipelines.nightly.history import History, new_run_id
from pipelines.nightly.judgement import Finding, Judgement, judge
from pipelines.nightly.other_code import ROOT, Code, OtherCodeError, freeze
from pipelines.nightly.outputs import write_all
from pipelines.nightly.outputs.results import Results
from pipelines.nightly.page.write import write_page
from pipelines.nightly.record import Exit, Night, Outcome, State
from pipelines.stages.settings import Setting

RAN, BASELINE = "ran", "baseline"
WORK_PREFIX = ".work-"
ORDER = ("data", "regenerate", "replay", "accuracy", "fresh", "failures", "tail", "speed")
NUMBERS_NEED = ("data", "regenerate")  # gates without which the later ones would compare other things


@dataclass(frozen=True, slots=True)
class Request:
    """What is asked of a night."""

    recipe: str
    history: Path
    regimes: tuple[str, ...]
    seed: int  # of the fresh pictures
    solvers: tuple[Setting, ...] = ()  # systems beside ours, judged on the pinned pictures
    workers: int = 1
    without: tuple[str, ...] = ()  # gates that are left out


@dataclass(slots=True)
class Found:
    """What a night has found so far."""

    outcomes: list[Outcome] = field(default_factory=list)
    findings: dict[str, Sequence[Finding]] = field(default_factory=dict)  # by suite
    measures: dict[str, pa.Table] = field(default_factory=dict)  # by suite and side
    data: dict[str, str] = field(default_factory=dict)  # what was read, and its digest

    def stopped(self) -> bool:
        """Whether a gate has failed that the later ones stand on."""
        return any(item.state is State.FAILED and item.gate in (RAN, BASELINE, *NUMBERS_NEED) for item in self.outcomes)


@dataclass(frozen=True, slots=True)
class Desk:
    """What the steps of a night work with."""

    request: Request
    history: History
    work: Path
    baselines: Baselines
    engine: LocalEngine
    console: Console

    @property
    def settings(self) -> tuple[Setting, ...]:
        """What is estimated on the pinned pictures."""
        return suites.READ + self.request.solvers

    def waived(self, gate: str, place: str, what: str | int | None) -> bool:
        """Whether somebody has accepted it."""
        return self.baselines.is_waived(gate, place, what, datetime.date.today())


def run_night(request: Request, console: Console) -> Night:
    """Run a night and append it to the history.

    Raises:
        UserError: wrong use: a recipe, regime, solver or `baselines.toml` that is not usable, or a folder that cannot
            be written.
    """
    started = datetime.datetime.now(datetime.UTC)
    wanted = suites.suites(suites.PINNED, request.recipe, request.regimes)
    baselines, history = load(request.history / FILE_NAME), History(request.history)
    has_baseline = any(item.recipe == request.recipe for item in baselines.baselines)
    baseline = baselines.current(request.recipe) if has_baseline else None
    found = Found(data={"code": freeze(request.history / "code").name})
    with _work_folder(request.history) as work:
        desk = Desk(request, history, work, baselines, LocalEngine(request.workers), console)
        try:
            _judge_all(desk, wanted, baseline, found)
        except (UserError, OtherCodeError) as error:
            found.outcomes.append(Outcome(RAN, State.FAILED, f"could not run: {error}", Exit.COULD_NOT_RUN))
    left = [gate for gate in ORDER if gate not in {item.gate for item in found.outcomes}]
    found.outcomes += [Outcome(gate, State.NOT_RUN, "nothing to judge") for gate in left]
    night = Night(
        new_run_id(started), started, request.recipe, baseline.name if baseline else "", tuple(facts()),
        tuple(found.data.items()), tuple(found.outcomes),
    )  # fmt: skip
    history.append(night, found.findings, accuracy.ALPHA, found.measures)
    write_all(Results(night, found.findings, accuracy.ALPHA, found.measures), request.history)
    write_page(history, night.run_id, request.history / "report.html")
    return night


def facts() -> list[tuple[str, str]]:
    """Commit, versions, processor and BLAS kernel."""
    made = provenance()
    return [
        ("commit", made.commit), ("python", made.python), *made.libraries, ("processor", made.processor),
        ("blas", made.blas),
    ]  # fmt: skip


def _judge_all(desk: Desk, wanted: list[suites.Suite], baseline: Baseline | None, found: Found) -> None:
    store = desk.request.history / "pictures"
    pictures = {suite.name: suite.make(store / suite.name, desk.engine, desk.console) for suite in wanted}
    digests = {name: suites.pictures_digest(dataset) for name, dataset in pictures.items()}
    pinned = combined_digest("", digests.items())
    found.data |= {suites.PINNED: pinned, **digests}
    found.measures["pinned new"], replayed = _read_pinned(desk, pictures)
    found.data |= {f"replay {name}": digest for name, digest in replayed.items()}
    count = sum(dataset.read("frames", ["frame_id"]).num_rows for dataset in pictures.values())
    found.outcomes.append(Outcome(RAN, State.PASSED, f"every stage ran on {count} pinned frames"))
    if baseline is None:
        told = "there is no baseline of this recipe yet; make this run the first with `nightly accept`"
        found.outcomes.append(Outcome(BASELINE, State.FAILED, told, Exit.NO_VERDICT))
        return
    _judge_data(desk, pictures, pinned, replayed, baseline, found)
    if not found.stopped():
        _judge_numbers(desk, pictures, baseline, found)


def _judge_data(
    desk: Desk, pictures: dict[str, Dataset], pinned: str, replayed: dict[str, str], baseline: Baseline, found: Found
) -> None:
    """Whether tonight's numbers can be compared with the baseline's at all."""
    found.outcomes.append(data.judge(pinned, baseline.pinned_data))
    run = desk.history.run(baseline.run)
    known = {item["name"]: item["value"] for item in run["data"]}
    same = _machine({item["name"]: item["value"] for item in run["facts"]}) == _machine(dict(facts()))
    again = [item for name, dataset in pictures.items() for item in regenerate.render_again(name, dataset)]
    found.outcomes.append(regenerate.judge(again, same))
    old = {name.removeprefix("replay "): value for name, value in known.items() if name.startswith("replay ")}
    found.outcomes.append(replay.judge(old, replayed))


def _machine(known: dict[str, str]) -> dict[str, str]:
    return {name: value for name, value in known.items() if name != "commit"}


def _judge_numbers(desk: Desk, pictures: dict[str, Dataset], baseline: Baseline, found: Found) -> None:
    old, new = desk.history.measures(baseline.measures[suites.PINNED]), found.measures["pinned new"]
    found.measures["pinned old"] = old
    pinned = judge(old, new, accuracy.ALPHA, paired=True)
    found.findings[suites.PINNED] = pinned.findings
    found.outcomes.append(accuracy.judge(pinned, lambda *what: desk.waived(accuracy.GATE, *what)))
    code = code_of(baseline, desk.request.history)
    tonight = _judge_fresh(desk, code, found) if fresh.GATE not in desk.request.without else None
    found.outcomes.append(failures.judge(pinned, tonight, lambda *what: desk.waived(failures.GATE, *what)))
    found.outcomes.append(tail.judge(old, new, lambda *what: desk.waived(tail.GATE, *what)))
    if speed.GATE not in desk.request.without:
        timings = _timings(desk, code, pictures)
        found.outcomes.append(speed.judge(timings, lambda stage: desk.waived(speed.GATE, stage, None)))


def _judge_fresh(desk: Desk, code: Code, found: Found) -> Judgement:
    first = _compare_fresh(desk, code, suites.FRESH, desk.request.seed, found)

    def again() -> Judgement:
        return _compare_fresh(desk, code, suites.CONFIRMING, desk.request.seed + suites.CONFIRMING_SEED, found)

    found.outcomes.append(fresh.judge(first, again, lambda *what: desk.waived(fresh.GATE, *what)))
    return first


def _compare_fresh(desk: Desk, code: Code, kind: str, seed: int, found: Found) -> Judgement:
    sides: tuple[list[pa.Table], list[pa.Table]] = ([], [])
    for suite in suites.suites(kind, desk.request.recipe, desk.request.regimes, seed):
        pictures = suite.make(desk.work / suite.name, desk.engine, desk.console)
        found.data[suite.name] = suites.pictures_digest(pictures)
        before = suites.read_by(code, pictures, desk.work / f"{suite.name}-old", suites.READ, desk.request.workers)
        after = suites.read_here(pictures, desk.work / f"{suite.name}-new", suites.READ, desk.engine, desk.console)
        for side, reading in zip(sides, (before, after), strict=True):
            side.append(reading.measures)
    old, new = (pa.concat_tables(side) for side in sides)
    found.measures |= {f"{kind} old": old, f"{kind} new": new}
    judged = judge(old, new, fresh.ALPHA, paired=True)
    found.findings[kind] = judged.findings
    return judged


def _read_pinned(desk: Desk, pictures: dict[str, Dataset]) -> tuple[pa.Table, dict[str, str]]:
    tables: list[pa.Table] = []
    replayed: dict[str, str] = {}
    for name, dataset in pictures.items():
        reading = suites.read_here(dataset, desk.work / name, desk.settings, desk.engine, desk.console)
        tables.append(reading.measures)
        replayed |= {f"{name} {setting}": digest for setting, digest in reading.replayed.items()}
    return pa.concat_tables(tables), replayed


def _timings(desk: Desk, code: Code, pictures: dict[str, Dataset]) -> list[speed.Timing]:
    name, dataset = next(iter(pictures.items()))
    folders = tuple(suites.copy_pictures(dataset, desk.work / f"{name}-{side}") for side in ("time-old", "time-new"))
    frames = dataset.read_shard(dataset.shards("frames")[0], ["frame_id"]).num_rows
    return speed.time_both(code, Code(ROOT), (folders[0], folders[1]), frames)


def code_of(baseline: Baseline, history: Path) -> Code:
    """The baseline's code.

    Raises:
        UserError: it names an installed version whose folder is not there.
    """
    if baseline.checkout is not None:
        return Code(baseline.checkout)
    folder = history / "code" / f"eposit-{baseline.version}"
    if not folder.is_dir():
        wanted = f"pip install --no-deps --target {folder} eposit=={baseline.version}"
        raise UserError(f"baseline {baseline.name} is version {baseline.version} of eposit, not in {folder}; {wanted}")
    return Code(folder, ("eposit",))


@contextmanager
def _work_folder(history: Path) -> Iterator[Path]:
    """A folder of this night alone; those that killed nights of this machine left are removed."""
    for folder in history.glob(f"{WORK_PREFIX}*"):
        try:
            with hold(folder):
                shutil.rmtree(folder, ignore_errors=True)
        except (HeldError, OSError):
            pass
    work = history / own_name(WORK_PREFIX)
    try:
        work.mkdir(parents=True)
    except OSError as error:
        raise UserError(f"cannot write {work}: {error.strerror}; choose another --history") from error
    with hold(work):
        try:
            yield work
        finally:
            shutil.rmtree(work, ignore_errors=True)

"""One night from beginning to end: pictures, what both codes read in them, the gates in their order."""

from __future__ import annotations

import datetime
import traceback

import pyarrow as pa
from rich.console import Console

from datasets.store.dataset import Dataset
from datasets.store.digest import combined_digest
from pipelines.engines.local import LocalEngine
from pipelines.machine import provenance
from pipelines.nightly import suites
from pipelines.nightly.accepted import Baseline
from pipelines.nightly.baselines import FILE_NAME, Baselines, load
from pipelines.nightly.desk import Desk, Request, code_of
from pipelines.nightly.differences import other_code, other_machine
from pipelines.nightly.found import BASELINE, RAN, Found
from pipelines.nightly.fresh_pictures import judge_fresh
from pipelines.nightly.gates import accuracy, data, failures, fresh, regenerate, replay, speed, tail
from pipelines.nightly.history import History, new_run_id
from pipelines.nightly.judgement import judge
from pipelines.nightly.other_code import Code, freeze
from pipelines.nightly.outputs import write_all
from pipelines.nightly.outputs.results import Results
from pipelines.nightly.page.frames import rendered_otherwise
from pipelines.nightly.page.write import Shown, write_page
from pipelines.nightly.reading import Here, Reading
from pipelines.nightly.record import Exit, Night, Outcome, State, Timing
from pipelines.nightly.systems import kept_code
from pipelines.nightly.work_folder import work_folder
from pipelines.nightly.worst_frames import pictures_of_all, worst
from pipelines.pages.pictures import Picture

ENDED_WAIVERS = "ended waivers"  # name of a fact
ORDER = ("data", "regenerate", "replay", "accuracy", "fresh", "failures", "tail", "speed")


def run_night(request: Request, console: Console) -> Night:
    """Run a night and append it to the history. An error in a gate is that gate's outcome, with exit code 4.

    Raises:
        UserError: wrong use: a recipe, regime, system or `baselines.toml` that is not usable, a damaged history, or a
            folder that cannot be written.
    """
    started = datetime.datetime.now(datetime.UTC)
    wanted = suites.suites(suites.PINNED, request.recipe, request.regimes)
    baselines, history = load(request.history / FILE_NAME), History(request.history)
    history.check()
    baseline = next((item for item in reversed(baselines.baselines) if item.recipe == request.recipe), None)
    here = Here(LocalEngine(request.workers), console, Code(freeze(request.history / "code")))
    functions = kept_code(request.systems, here.code)
    found = Found(data={"code": here.code.folder.name, suites.SEED: str(request.seed), **functions})
    with work_folder(request.history) as work:
        desk = Desk(request, history, work, baselines, here)
        _judge_all(desk, wanted, found)
        left = [gate for gate in ORDER if gate not in {item.gate for item in found.outcomes}]
        found.outcomes += [Outcome(gate, State.NOT_RUN, "nothing to judge") for gate in left]
        night = Night(
            new_run_id(started), started, request.recipe, baseline.name if baseline else "", tuple(_facts(baselines)),
            tuple(found.data.items()), tuple(found.outcomes), tuple(found.timings),
        )  # fmt: skip
        history.append(night, found.findings, accuracy.ALPHA, found.measures)
        write_all(Results(night, found.findings, accuracy.ALPHA, found.measures), request.history)
        worst_ones = _pictures(desk, night, baseline, found) if baseline and night.exit else []
        shown = Shown(worst_ones, rendered_otherwise(found.again, night.run_id, request.history))
        write_page(history, night.run_id, request.history / "report.html", shown)
    return night


def machine() -> list[tuple[str, str]]:
    """Versions, processor and BLAS kernel: where they differ, pictures may differ in a grey level."""
    made = provenance()
    return [("python", made.python), *made.libraries, ("processor", made.processor), ("blas", made.blas)]


def _facts(baselines: Baselines) -> list[tuple[str, str]]:
    """Commit and machine, and waivers that judge no longer."""
    ended = baselines.expired(datetime.date.today())
    return [("commit", provenance().commit), *machine(), *([(ENDED_WAIVERS, "; ".join(ended))] if ended else [])]


def _judge_all(desk: Desk, wanted: list[suites.Suite], found: Found) -> None:
    pictures: dict[str, Dataset] = {}
    replayed: dict[str, str] = {}
    with found.at_gate(RAN):
        store = desk.request.history / "pictures"
        pictures |= {suite.name: suite.make(store / suite.name, desk.engine, desk.console) for suite in wanted}
        digests = {name: suites.pictures_digest(dataset) for name, dataset in pictures.items()}
        found.data |= {suites.PINNED: combined_digest("", digests.items()), **digests}
        readings = _read_pinned(desk, pictures)
        found.measures["pinned new"] = pa.concat_tables([item.measures for item in readings.values()])
        for name, item in readings.items():
            replayed |= {f"{name} {setting}": digest for setting, digest in item.replayed.items()}
        found.data |= {f"replay {name}": digest for name, digest in replayed.items()}
        count = sum(dataset.read("frames", ["frame_id"]).num_rows for dataset in pictures.values())
        told = [
            f"every stage ran on {count} pinned frames",
            *(text for item in readings.values() for text in item.left_out),
        ]
        found.outcomes.append(Outcome(RAN, State.PASSED, "; ".join(told)))
    if found.stopped():
        return
    baseline = _baseline(desk, found)
    if baseline is not None:
        _judge_data(desk, pictures, replayed, baseline, found)
        if not found.stopped():
            _judge_numbers(desk, pictures, baseline, found)


def _baseline(desk: Desk, found: Found) -> Baseline | None:
    """The current baseline; without one, or without its code, that is the night's outcome."""
    recipe = desk.request.recipe
    if all(item.recipe != recipe for item in desk.baselines.baselines):
        told = f"there is no baseline of recipe {recipe} yet; make this run the first with `nightly accept`"
        found.outcomes.append(Outcome(BASELINE, State.FAILED, told, Exit.NO_VERDICT))
        return None
    with found.at_gate(BASELINE):
        return desk.baselines.current(recipe)


def _judge_data(
    desk: Desk, pictures: dict[str, Dataset], replayed: dict[str, str], baseline: Baseline, found: Found
) -> None:
    """Whether tonight's numbers can be compared with the baseline's at all."""
    with found.at_gate(data.GATE):
        found.outcomes.append(data.judge(found.data[suites.PINNED], baseline.pinned_data))
    with found.at_gate(regenerate.GATE):
        found.again += [item for name, dataset in pictures.items() for item in regenerate.render_again(name, dataset)]
        facts = _mapping(desk.history.run(baseline.run)["facts"])
        found.outcomes.append(regenerate.judge(found.again, other_machine(facts, dict(machine()))))
    with found.at_gate(replay.GATE):
        run = desk.history.run(baseline.run)
        known, facts = _mapping(run["data"]), _mapping(run["facts"])
        old = {name.removeprefix("replay "): value for name, value in known.items() if name.startswith("replay ")}
        moved = replay.largest_change(
            desk.history.measures(baseline.measures[suites.PINNED]), found.measures[f"{suites.PINNED} new"]
        )
        reasons = (*other_machine(facts, dict(machine())), *other_code(known.get("code"), found.data["code"]))
        found.outcomes.append(replay.judge(old, replayed, moved, reasons))


def _mapping(pairs: list[dict[str, str]]) -> dict[str, str]:
    return {item["name"]: item["value"] for item in pairs}


def _judge_numbers(desk: Desk, pictures: dict[str, Dataset], baseline: Baseline, found: Found) -> None:
    pinned = tonight = None
    with found.at_gate(accuracy.GATE):
        old = desk.history.measures(baseline.measures[suites.PINNED])
        found.measures["pinned old"] = old
        pinned = judge(old, found.measures["pinned new"], accuracy.ALPHA, paired=True)
        found.findings[suites.PINNED] = pinned.findings
        found.outcomes.append(accuracy.judge(pinned, lambda *what: desk.waived(accuracy.GATE, *what)))
    if pinned is None:
        return
    if fresh.GATE not in desk.request.without:
        with found.at_gate(fresh.GATE):
            tonight = judge_fresh(desk, baseline, found)
    with found.at_gate(failures.GATE):
        found.outcomes.append(failures.judge(pinned, tonight, lambda *what: desk.waived(failures.GATE, *what)))
    with found.at_gate(tail.GATE):
        old, new = (found.measures[f"pinned {side}"] for side in ("old", "new"))
        found.outcomes.append(tail.judge(old, new, lambda *what: desk.waived(tail.GATE, *what)))
    if speed.GATE not in desk.request.without:
        with found.at_gate(speed.GATE):
            found.timings += _timings(desk, baseline, pictures)
            found.outcomes.append(speed.judge(found.timings, lambda stage: desk.waived(speed.GATE, stage, None)))


def _read_pinned(desk: Desk, pictures: dict[str, Dataset]) -> dict[str, Reading]:
    systems = desk.request.systems
    return {name: desk.here.read(dataset, desk.work / name, systems) for name, dataset in pictures.items()}


def _pictures(desk: Desk, night: Night, baseline: Baseline, found: Found) -> list[Picture]:
    """The worst frames of a night that is not fine; none, and the reason on stderr, if they cannot be shown."""
    root, workers = desk.request.history, desk.request.workers
    try:
        noticed = worst(found.measures, found.findings)
        return pictures_of_all(noticed, night.run_id, root, desk.work, code_of(baseline, root), workers)
    except Exception:  # the verdict is worth more than its pictures
        traceback.print_exc()
        return []


def _timings(desk: Desk, baseline: Baseline, pictures: dict[str, Dataset]) -> list[Timing]:
    name, dataset = next(iter(pictures.items()))
    folders = tuple(suites.copy_pictures(dataset, desk.work / f"{name}-{side}") for side in ("time-old", "time-new"))
    frames = dataset.read_shard(dataset.shards("frames")[0], ["frame_id"]).num_rows
    return speed.time_all(desk.frozen(baseline), desk.here.code, (folders[0], folders[1]), frames)

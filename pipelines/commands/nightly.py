"""`nightly`: accuracy against a frozen baseline, night by night."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from datasets.errors import UserError
from pipelines.commands import options as o
from pipelines.commands.tables import Column, print_json, print_table

if TYPE_CHECKING:
    from pipelines.nightly.record import Night

NIGHTS_BACK = 14  # of the trend that `explain` prints
REGIMES = ["typical", "harsh"]
LONGEST_S = 86400.0  # that a function may take

HistoryFolder = Annotated[Path, typer.Option("--history", help="Folder of the nights: history, baselines, pictures.")]
Regimes = Annotated[list[str], typer.Option("--regime", help="Sensor regime of the pictures; may be given again.")]
Seed = Annotated[int | None, typer.Option(min=0, help="Seed of the fresh pictures.  [default: the date, as 20260504]")]
Without = Annotated[
    list[str] | None, typer.Option("--without", help="Gate that is left out: fresh or speed; may be given again.")
]
Estimators = Annotated[
    list[str] | None,
    typer.Option(
        "--estimator",
        metavar="PACKAGE.MODULE:FUNCTION",
        help="Your whole system: a function of image, camera and target; may be given again.",
    ),
]
PoseFiles = Annotated[
    list[str] | None,
    typer.Option(
        "--poses",
        metavar="FILE",
        help="Poses of another system for the pinned pictures, as poses-{regime}.csv if there are several regimes; may "
        "be given again.",
    ),
]
PoseNames = Annotated[
    list[str] | None, typer.Option("--name", help="Name of the poses of --poses, in their order, in tables and page.")
]
TimeLimit = Annotated[
    float,
    typer.Option(metavar="SECONDS", help="Time that each of your functions may take on the pictures of a regime."),
]
RunName = Annotated[str, typer.Argument(metavar="RUN", help="Run of the history, or `latest`.")]
SliceName = Annotated[str, typer.Argument(metavar="SLICE", help="As regime/camera/system.")]
OfRun = Annotated[str, typer.Option("--run", help="Run of the history.")]
SuiteName = Annotated[str, typer.Argument(metavar="SUITE", help="As the page names it, for example pinned-typical.")]
Reason = Annotated[str, typer.Option(help="Why; it stays in baselines.toml.")]
Until = Annotated[str | None, typer.Option(metavar="DATE", help="Last day of a waiver, as 2026-05-04.")]
By = Annotated[str | None, typer.Option(help="Who accepts.  [default: the user's name]")]
Gate = Annotated[
    str | None, typer.Option(help="Waive a failure of this gate instead: accuracy, fresh, failures, tail or speed.")
]
OfSlice = Annotated[str | None, typer.Option("--slice", help="Slice of the failure; of gate speed the stage.")]
Metric = Annotated[str | None, typer.Option(help="Metric of the failure.")]
FrameId = Annotated[int | None, typer.Option("--frame", help="Frame of the failure, of gate failures.")]


def run(
    recipe: o.RecipeName,
    history: HistoryFolder,
    regime: Regimes = REGIMES,
    seed: Seed = None,
    solver: o.MoreSolvers = None,
    estimator: Estimators = None,
    poses: PoseFiles = None,
    name: PoseNames = None,
    pose_format: o.PoseFormat = "table",
    time_limit: TimeLimit = 3600.0,
    without: Without = None,
    workers: o.Workers = 1,
    quiet: o.Quiet = False,
) -> None:
    """Run a night: exit code 0 fine, 1 worse, 2 wrong use, 3 no verdict, 4 could not run.

    The pinned pictures are made in the first night. Without a baseline there is no verdict: `nightly accept` makes a
    run the baseline, and keeps a copy of its code. The page, and files for machines, lie in the history's folder.
    """
    from pipelines.nightly.desk import Request
    from pipelines.nightly.night import run_night
    from pipelines.nightly.systems import asked

    for gate in without or []:
        if gate not in ("fresh", "speed"):
            raise UserError(f"--without {gate}: choose fresh or speed; the other gates cost nothing")
    if not 0.0 < time_limit <= LONGEST_S:
        raise UserError(f"--time-limit {time_limit:g}: give seconds above 0 and at most {LONGEST_S:g}, as 600")
    regimes = tuple(dict.fromkeys(regime))
    request = Request(
        recipe=recipe,
        history=history,
        regimes=regimes,
        seed=int(f"{datetime.date.today():%Y%m%d}") if seed is None else seed,
        systems=asked(
            recipe, regimes, (solver or [], estimator or []), (poses or [], name or [], pose_format), time_limit
        ),
        workers=workers,
        without=tuple(without or ()),
    )
    night = run_night(request, Console(quiet=quiet, stderr=True))
    _print_night(night, history)
    if night.exit:
        raise SystemExit(int(night.exit))


def accept(
    run: RunName,
    history: HistoryFolder,
    reason: Reason,
    until: Until = None,
    by: By = None,
    gate: Gate = None,
    slice: OfSlice = None,
    metric: Metric = None,
    frame: FrameId = None,
) -> None:
    """Make a run the baseline, or waive one failure of it (--gate); who, why and until when is kept."""
    from pipelines.nightly.acceptance import accept_baseline, waive

    if gate is None:
        if until is not None or slice is not None or metric is not None or frame is not None:
            raise UserError("--until, --slice, --metric and --frame belong to a waiver; give its --gate, too")
        name = accept_baseline(history, run, reason, by)
        typer.echo(f"{name} is the baseline now; its code is kept in {history / 'code'}")
        return
    told = waive(history, run, gate=gate, slice=slice, metric=metric, frame=frame, reason=reason, by=by, until=until)
    typer.echo(f"waived: {told}")


def explain(slice: SliceName, history: HistoryFolder, run: OfRun = "latest", json: o.Json = False) -> None:
    """Show what a run found in one slice: every metric, its last nights, and the frames that moved most."""
    from pipelines.nightly.explanation import explain as explained

    found = explained(history, run, slice, NIGHTS_BACK)
    if json:
        print_json(found.as_json())
        return
    typer.echo(f"{slice}, run {found.run_id}")
    columns = [Column("suite"), Column("metric"), *(Column(name, True) for name in ("change", "95 %", "margin"))]
    print_table((*columns, Column("verdict")), found.rows())
    for line in found.lines():
        typer.echo(line)


def frame(
    suite: SuiteName,
    frame_id: o.FrameNumber,
    history: HistoryFolder,
    run: OfRun = "latest",
    out: o.Png = Path("frame.png"),
) -> None:
    """Make one picture of a run again, into a PNG, and tell what this code finds in it."""
    from pipelines.commands.pictures import show
    from pipelines.nightly.one_frame import remake

    show(remake(history, run, suite, frame_id), out, f"frame {frame_id} of {suite}")


def report(history: HistoryFolder, run: OfRun = "latest") -> None:
    """Write report.html anew from the history."""
    from pipelines.nightly.history import History
    from pipelines.nightly.page.write import write_page

    path = history / "report.html"
    nights = History(history)
    write_page(nights, nights.name_of(run), path)
    typer.echo(str(path))


def _print_night(night: Night, history: Path) -> None:
    from pipelines.nightly.night import ENDED_WAIVERS

    if ended := dict(night.facts).get(ENDED_WAIVERS):
        typer.echo(ended, err=True)
    rows = [(item.gate, item.state, item.sentence) for item in night.outcomes]
    print_table((Column("gate"), Column("state"), Column("what was found")), rows)
    typer.echo(f"\nexit {int(night.exit)}, {night.sentence}\nrun {night.run_id}, page {history / 'report.html'}")

"""`compare`: whether the accuracy of one dataset, of one run, or of one state of the code is worse than another's."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from datasets.errors import UserError
from pipelines.commands import options as o
from pipelines.commands.opening import opened
from pipelines.commands.tables import Column, print_json, print_table

if TYPE_CHECKING:
    from pipelines.nightly.judgement import Failures, Finding, Judgement

WORSE = 1  # exit code
COLUMNS = (
    Column("  verdict"), Column("metric"), Column("from", True), Column("to", True), Column("change, 95 %", True),
)  # fmt: skip
MOST_NAMED = 10  # frames that fail anew, in one line

REGIMES = ["typical"]

Old = Annotated[str, typer.Argument(metavar="OLD", help="Dataset, commit, checkout, or run, to compare with.")]
New = Annotated[str, typer.Argument(metavar="NEW", help="The same of what is judged.")]
Alpha = Annotated[float, typer.Option(help="Chance of a false alarm, over all metrics and slices together.")]
OfHistory = Annotated[
    Path | None, typer.Option("--history", metavar="DIR", help="OLD and NEW are runs of these nights, or `latest`.")
]
CodeRecipe = Annotated[str, typer.Option("--recipe", help="Recipe of the pictures that two commits read.")]
CodeRegimes = Annotated[
    list[str], typer.Option("--regime", help="Sensor regime of the pictures that two commits read; may be given again.")
]
Kept = Annotated[
    Path, typer.Option("--out", help="Folder that keeps pictures and code of commits; a history's will do.")
]


def compare(
    old: Old,
    new: New,
    alpha: Alpha = 0.01,
    history: OfHistory = None,
    recipe: CodeRecipe = "nightly",
    regime: CodeRegimes = REGIMES,
    out: Kept = Path("out/compare"),
    workers: o.Workers = 1,
    quiet: o.Quiet = False,
    json: o.Json = False,
) -> None:
    """Tell whether NEW is worse than OLD; exit code 1 if it is.

    Two datasets that have been scored, or two runs of a history: the same views, with other code or another sensor, are
    compared frame by frame, which shows the smallest changes; other views of the same recipe as two samples. Two
    commits or checkouts: each reads the same pictures in a process of its own.
    """
    from pipelines.nightly.comparison import LEAST_POSES
    from pipelines.nightly.revisions import Pictures, compare_code

    if not 0.0 < alpha < 1.0:
        raise UserError(f"--alpha {alpha:g}: a chance lies between 0 and 1; take 0.01")
    if history is not None:
        found = _of_runs(history, old, new, alpha)
    elif _is_dataset(old) or _is_dataset(new):
        found = _of_datasets(Path(old), Path(new), alpha)
    else:
        pictures = Pictures(recipe, tuple(dict.fromkeys(regime)), out)
        found = compare_code(old, new, pictures, alpha, workers, Console(quiet=quiet, stderr=True))
    if not found.findings and not found.identical:
        few = f"have no slice with {LEAST_POSES} common poses"
        raise UserError(f"{old} and {new} {few}; compare larger runs of one recipe")
    if json:
        print_json(_as_json(found, alpha))
    else:
        _print(found, alpha)
    if _is_worse(found):
        raise SystemExit(WORSE)


def _is_dataset(name: str) -> bool:
    """Whether a name is a folder, and no checkout: what is wrong with a dataset is told of it as such."""
    from pipelines.nightly.revisions import is_checkout

    return Path(name).is_dir() and not is_checkout(Path(name))


def _of_datasets(old: Path, new: Path, alpha: float) -> Judgement:
    from pipelines.nightly.judgement import judge
    from pipelines.nightly.measures import measure, same_views

    before, after = opened(old), opened(new)
    return judge(measure(before), measure(after), alpha, same_views(before, after))


def _of_runs(root: Path, old: str, new: str, alpha: float) -> Judgement:
    """What two runs measured on the pinned pictures, frame by frame if these were the same."""
    from pipelines.nightly.history import History
    from pipelines.nightly.judgement import judge

    history = History(root)
    runs = [history.run(name) for name in (old, new)]
    before, after = (history.pinned(run) for run in runs)
    data = [{item["name"]: item["value"] for item in run["data"]} for run in runs]
    return judge(before, after, alpha, data[0]["pinned"] == data[1]["pinned"])


def _is_worse(found: Judgement) -> bool:
    return found.new_failures > 0 or bool(found.lost) or any(item.verdict == "worse" for item in found.findings)


def _print(found: Judgement, alpha: float) -> None:
    from pipelines.nightly.comparison import Verdict

    changed = found.of(Verdict.WORSE) + found.of(Verdict.BETTER)
    for name in dict.fromkeys(item.slice for item in changed):
        typer.echo(name)
        print_table(COLUMNS, [_cells(item) for item in changed if item.slice == name])
        typer.echo()
    for item in found.failures:
        if item.new:
            typer.echo(_failure_line(item))
    if found.lost:
        typer.echo(f"no longer there, which is worse: {', '.join(found.lost)}")
    for names, side in ((found.only_old, "NEW"), (found.only_new, "OLD")):
        if names:
            typer.echo(f"not in {side}, so not compared: {', '.join(names)}")
    typer.echo(_sentence(found, alpha))


def _cells(item: Finding) -> tuple[str, ...]:
    change = item.change
    low, high = change.interval
    unit = "" if change.metric.unit == "1" else f" ({change.metric.unit})"
    numbers = f"{change.old:.3g}", f"{change.new:.3g}", f"{low:+.2g} to {high:+.2g}"
    return f"  {item.verdict}", f"{change.metric.name}{unit}", *numbers


def _failure_line(item: Failures) -> str:
    shown = ", ".join(map(str, item.new[:MOST_NAMED])) + (", ..." if len(item.new) > MOST_NAMED else "")
    return f"{item.slice}: {len(item.new)} of {item.frames} frames fail anew, {len(item.mended)} no longer: {shown}"


def _sentence(found: Judgement, alpha: float) -> str:
    from pipelines.nightly.comparison import Verdict

    if found.identical:
        return "identical: every number of every frame is the same"
    counts = {verdict: len(found.of(verdict)) for verdict in Verdict}
    told = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count) or "nothing to compare"
    how = "frame by frame" if found.paired else "as two samples of other views"
    failed = f"; {found.new_failures} new failures" if found.paired else ""
    return f"{len(found.findings)} metrics compared {how}, false alarms at {100 * alpha:g} %: {told}{failed}"


def _as_json(found: Judgement, alpha: float) -> dict[str, Any]:
    tests = max(len(found.findings), 1)
    return {
        "worse": _is_worse(found),
        "identical": found.identical,
        "paired": found.paired,
        "alpha": alpha,
        "lost": found.lost,
        "only_old": found.only_old,
        "only_new": found.only_new,
        "failures": [
            {"slice": item.slice, "frames": item.frames, "new": item.new, "mended": item.mended, "p": item.p}
            for item in found.failures
        ],
        "findings": [
            {
                "slice": item.slice,
                "metric": item.change.metric.name,
                "unit": item.change.metric.unit,
                "verdict": item.verdict,
                "poses": item.change.poses,
                "old": item.change.old,
                "new": item.change.new,
                "effect": item.change.effect,
                "interval": item.change.interval,
                "p": item.change.p,
                "margin": item.change.metric.margin,
                "smallest_visible": item.change.smallest_visible(alpha, tests),
            }
            for item in found.findings
        ],
    }

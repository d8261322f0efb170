"""Commands beside the stages: checks, recipes, speed."""

from __future__ import annotations

import itertools
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from datasets.errors import UserError
from pipelines.commands import options as o
from pipelines.commands.opening import load
from pipelines.commands.tables import Column, Footnotes, print_footnotes, print_json, print_keys, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pipelines.bench.table import Comparison, Figure, Row
    from render.targets.kinds import AnyTarget


def verify(folder: o.Folder, rerender: o.Rerender = 0, json: o.Json = False) -> None:
    """Check every file that plan and manifest name: a line for each problem and exit code 2, or the content's hash."""
    from datasets.store.dataset import open_dataset
    from datasets.verify import verify as check
    from datasets.verify.recipe import unreadable_recipe

    if told := unreadable_recipe(folder):
        raise UserError(told)
    dataset = open_dataset(folder)
    digest, problems = check(dataset)
    if rerender and not problems:
        from pipelines.stages.rerender import rerendered_problems

        problems = rerendered_problems(dataset, rerender)
    if json:
        shown = [{"path": str(item.path), "kind": item.kind, "text": item.text} for item in problems]
        print_json({"content": digest, "problems": shown})
    elif not problems:
        typer.echo(f"content {digest}")
    if problems:
        raise UserError("\nerror: ".join(item.text for item in problems))


def doctor(json: o.Json = False) -> None:
    """Tell what this machine has and what is missing."""
    from pipelines.doctor import diagnose

    checks = diagnose()
    if json:
        print_json([asdict(check) for check in checks])
    else:
        rows = [("ok" if check.fine else "MISSING", check.name, check.found) for check in checks]
        print_table((Column("state"), Column("what"), Column("found")), rows)
    if not all(check.fine for check in checks):
        raise UserError("something that rendering needs is missing; see the lines marked MISSING")


def bench(
    recipe: o.RecipeName = "demo",
    poses: o.Poses = 2,
    only: o.Only = None,
    memory: o.Memory = None,
    out: o.Markdown = None,
    regime: o.Regime = None,
    json: o.Json = False,
) -> None:
    """Speed as ratios measured side by side, and memory over a long run."""
    from datasets.store.atomic import write_text
    from pipelines.bench.command import measured
    from pipelines.bench.table import Comparison, Figure, markdown
    from pipelines.machine import facts

    rows = measured(load(recipe, regime)[0], poses, only or [], memory)
    times = [row for row in rows if isinstance(row, Comparison)]
    figures = [row for row in rows if isinstance(row, Figure)]
    if json:
        told = {"machine": dict(facts()), "times": [*map(asdict, times)], "figures": [*map(asdict, figures)]}
        print_json(told)
    else:
        _print_measured(times, figures, facts())
    if out is not None:
        write_text(out, markdown(rows, facts()))


def target(
    out: o.Printed,
    recipe: o.TargetRecipe = None,
    pattern: o.Pattern = None,
    values: o.TargetValues = None,
) -> None:
    """Write a target's print at true size, to be printed and measured: --pattern charuco --set columns=8."""
    from datasets.store.atomic import write_text
    from pipelines.target_print import advice, written

    chosen = _target(recipe, pattern, values or [])
    write_text(out, written(chosen, out.suffix))
    typer.echo(f"{out}: {advice(chosen)}")


def _target(recipe: str | None, pattern: str | None, values: list[str]) -> AnyTarget:
    """The target of a recipe, or of a pattern with values of its own."""
    from datasets.recipe.model import target_of

    if (recipe is None) == (pattern is None):
        raise UserError("target takes either a recipe or --pattern; give one of them")
    if recipe is None:
        return target_of(pattern or "", values)
    if values:
        raise UserError("--set goes with --pattern; to change a recipe's target, change its [target]")
    return load(recipe, None)[0].target


def _print_measured(times: list[Comparison], figures: list[Figure], machine: list[tuple[str, str]]) -> None:
    from pipelines.bench.table import short

    notes = Footnotes()
    if times:
        titles = ("ours, ms", "other, ms", "", "ratio", "CPU")
        cells = [
            (short(row.ours_ms), short(row.other_ms), notes.mark(row.other), short(row.ratio), short(row.cpu_ratio))
            for row in times
        ]
        _print_by_part("times", titles, times, cells, notes)
    if times and figures:
        typer.echo()
    if figures:
        texts = [(row.figure, row.value, notes.mark(row.other)) for row in figures]
        _print_by_part("figures", ("ours", "other", ""), figures, texts, notes)
    print_footnotes(notes)
    typer.echo("\nratio: how many of ours fit into one of the other\nCPU: the same ratio of processor times\n")
    print_keys((name, value, "") for name, value in machine)


def _print_by_part(
    title: str, titles: Sequence[str], rows: Sequence[Row], cells: Sequence[tuple[str, ...]], notes: Footnotes
) -> None:
    """A table with a line for each part and its rows indented below. cells: those behind each row's name."""
    shown: list[tuple[str, ...]] = []
    for part, group in itertools.groupby(zip(rows, cells, strict=True), lambda pair: pair[0].part):
        shown.append((part, *[""] * len(titles)))
        shown += [(f"  {row.ours}", *cell) for row, cell in group]
    print_table((Column(title), *(Column(name, number=True) for name in titles)), shown, notes)


def paper(
    out: o.PaperOut = Path("out/paper"),
    only: o.PaperParts = None,
    seeds: o.Seeds = 20,
    points_only: o.PointsOnly = False,
    workers: o.Workers = 1,
) -> None:
    """The EPOSIT paper, reproduced claim by claim, and what goes beyond it."""
    from pipelines.paper.command import reproduce

    for path in reproduce(out, only or [], seeds, points_only, workers):
        typer.echo(path)


def recipes(json: o.Json = False) -> None:
    """List the recipes that come with the package."""
    from datasets.plan import frame_count
    from datasets.recipe.model import load_recipe, recipe_names

    found = [load_recipe(name)[0] for name in recipe_names()]
    rows = [(name, frame_count(recipe), recipe.description) for name, recipe in zip(recipe_names(), found, strict=True)]
    if json:
        print_json([dict(zip(("name", "frames", "description"), row, strict=True)) for row in rows])
        return
    columns = (Column("name"), Column("frames", number=True), Column("description"))
    print_table(columns, [(name, str(frames), description) for name, frames, description in rows])


def describe(recipe: o.ShownRecipe = None, json: o.Json = False) -> None:
    """Every key of a recipe with its meaning: its defaults, the sensor's regimes and cameras to name, or its values."""
    rows = _described_keys(recipe)
    if json:
        titles = ("key", "value" if recipe else "default", "meaning")
        keys = [dict(zip(titles, row, strict=True)) for row in rows]
        print_json({"keys": keys} if recipe else {"keys": keys, **_what_recipes_name()})
        return
    print_keys(rows)
    if not recipe:
        _print_what_recipes_name()


def _described_keys(recipe: str | None) -> list[tuple[str, str, str]]:
    """Key, value and meaning of every key that a recipe takes; of every key that there is, with its default."""
    from datasets.recipe.model import describe as keys
    from datasets.recipe.model import load_recipe, values

    if not recipe:
        return list(keys())
    given = values(load_recipe(recipe)[0])
    return [(key, given[key], meaning) for key, _, meaning in keys() if key in given]


def _what_recipes_name() -> dict[str, object]:
    """The sensor's regimes and the cameras that come along, for JSON."""
    from datasets.recipe.camera_sets import camera_rows
    from render.sensor.presets import regime_rows, regimes

    return {
        "regimes": {f"sensor.{key}": dict(zip(regimes(), row, strict=True)) for key, row in regime_rows()},
        "cameras": {name: asdict(camera) for name, camera in camera_rows()},
    }


def _print_what_recipes_name() -> None:
    from datasets.recipe.camera_sets import camera_rows
    from render.sensor.presets import regime_rows, regimes

    typer.echo("\nThe sensor's regimes:\n")
    settings = [(f"sensor.{key}", *map(str, row)) for key, row in regime_rows()]
    print_table((Column("key"), *(Column(name, number=True) for name in regimes())), settings)
    typer.echo("\nCameras that a recipe can name:\n")
    numbers = ("fx", "fy", "cx", "cy")
    columns = (Column("cameras.from"), *(Column(key, number=True) for key in (*numbers, "size", "nominal")))
    cameras = [
        (name, *(f"{getattr(of, key):.7g}" for key in numbers), f"{of.width}x{of.height}", f"{of.nominal_f:g}")
        for name, of in camera_rows()
    ]
    print_table(columns, cameras)

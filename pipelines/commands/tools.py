"""Commands beside the stages: checks, recipes, speed."""

from __future__ import annotations

from pathlib import Path

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from datasets.errors import UserError
from pipelines.commands import options as o
from pipelines.commands.opening import load, opened


def verify(folder: o.Folder) -> None:
    """Check every shard and master, and print the hash of the content."""
    from datasets.store.verify import verify as check

    digest, problems = check(opened(folder))
    if problems:
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        raise UserError(f"{problems[0]}{more}")
    typer.echo(f"content {digest}")


def doctor() -> None:
    """Tell what this machine has and what is missing."""
    from pipelines.doctor import diagnose

    rows = diagnose()
    table = Table(box=None, show_header=False)
    for name, fine, found in rows:
        table.add_row("ok" if fine else "MISSING", name, found)
    Console().print(table)
    if not all(fine for _, fine, _ in rows):
        raise UserError("something that rendering needs is missing; see the lines marked MISSING")


def bench(
    recipe: o.RecipeName = "demo",
    poses: o.Poses = 2,
    only: o.Only = None,
    memory: o.Memory = None,
    out: o.Markdown = None,
    regime: o.Regime = None,
) -> None:
    """Speed as ratios measured side by side, and memory over a long run."""
    from pipelines.bench.command import bench as measure

    measure(load(recipe, regime)[0], poses, only or [], memory, out)


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


def recipes() -> None:
    """List the recipes that come with the package."""
    from datasets.plan import frame_count
    from datasets.recipe.model import load_recipe, recipe_names

    table = Table(box=None)
    for title in ("name", "frames", "description"):
        table.add_column(title)
    for name in recipe_names():
        recipe, _ = load_recipe(name)
        table.add_row(name, str(frame_count(recipe)), recipe.description)
    Console().print(table)


def describe(recipe: o.ShownRecipe = None) -> None:
    """Every key of a recipe with its meaning: its defaults and the sensor's regimes, or a recipe's values."""
    from datasets.recipe.model import describe as keys
    from datasets.recipe.model import load_recipe, values
    from render.sensor.presets import regime_rows, regimes

    rows = [(key, default, meaning) for key, default, meaning in keys()]
    if recipe:
        given = values(load_recipe(recipe)[0])
        rows = [(key, given[key], meaning) for key, _, meaning in rows if key in given]
    _print_table(("key", "value" if recipe else "default", "meaning"), rows)
    if not recipe:
        typer.echo("\nThe sensor's regimes:\n")
        _print_table(("key", *regimes()), [(f"sensor.{key}", *map(str, row)) for key, row in regime_rows()])


def _print_table(titles: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    table = Table(box=None)
    for title in titles:
        table.add_column(title, overflow="fold")
    for row in rows:
        table.add_row(*map(escape, row))
    Console().print(table)

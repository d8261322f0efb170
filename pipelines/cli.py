"""The command line: which commands there are, and how an error of theirs reaches the terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Any

import typer

from datasets.errors import UserError
from pipelines.commands import stages, tools

USER_ERROR, INTERRUPTED = 2, 130
ABOUT = "Rendered images of a chessboard through exact fish-eye cameras, detected, solved and scored against truth."

# Each command with its example, in the order of `--help`.
COMMANDS: tuple[tuple[Callable[..., None], str], ...] = (
    (stages.run, "run demo --out out/demo"),
    (stages.generate, "generate demo --out out/demo"),
    (stages.detect, "detect out/demo --detector opencv-subpix"),
    (stages.estimate, "estimate out/demo --points truth+noise --noise-px 0.4 --draws 5 --use four"),
    (stages.score, "score out/demo"),
    (stages.report, "report out/demo"),
    (stages.demo, "demo --out out/demo"),
    (tools.verify, "verify out/demo"),
    (tools.doctor, "doctor"),
    (tools.bench, "bench demo --only render --only solver --out bench.md"),
    (tools.recipes, "recipes"),
    (tools.describe, "describe demo"),
)


def command_line() -> typer.Typer:
    """The commands as one application."""
    app = typer.Typer(
        name="pipelines",
        help=ABOUT,
        epilog="Start with: python -m pipelines demo",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )
    for command, example in COMMANDS:
        app.command(epilog=f"Example: python -m pipelines {example}")(command)
    return app


<<<<<<< HEAD
@app.command(epilog="Example: python -m pipelines generate demo --out out/demo")
def generate(
    recipe: RecipeName,
    out: Out,
    regime: Regime = None,
    masters: Masters = None,
    workers: Workers = 1,
    quiet: Quiet = False,
) -> None:
    """Render images with their truth."""
    from pipelines import stages

    console = Console(quiet=quiet)
    stages.run_generate(_claim(recipe, out, regime, masters, console), workers, console)


@app.command(epilog="Example: python -m pipelines detect out/demo --detector opencv-subpix")
def detect(folder: Folder, detector: DetectorName = "edge-fit", workers: Workers = 1, quiet: Quiet = False) -> None:
    """Find corners and circle in the images; each detector's points stay beside the others'."""
    from pipelines import stages

    stages.run_detect(_open(folder), workers, Console(quiet=quiet), detector)


@app.command(
    epilog="Example: python -m pipelines estimate out/demo --points truth+noise --noise-px 0.4 --draws 5 --use four"
)
def estimate(
    folder: Folder,
    solver: Annotated[str, typer.Option(help="best, centred, eposit or posit.")] = "best",
    points: Annotated[str, typer.Option(help="detected, truth or truth+noise.")] = "detected",
    camera: Annotated[str, typer.Option(help="Camera the solver assumes: exact, nominal or paper.")] = "exact",
    use: Annotated[str, typer.Option(help="Object points: four or all.")] = "all",
    noise_px: Annotated[float, typer.Option(help="Standard deviation of truth+noise, px per axis.")] = 0.4,
    draws: Annotated[int, typer.Option(help="Draws of truth+noise.")] = 5,
    detector: DetectorName = "edge-fit",
    workers: Workers = 1,
    quiet: Quiet = False,
) -> None:
    """Estimate poses; nothing is rendered again."""
    from pipelines import stages
    from pipelines.estimate import Setting

    setting = Setting(solver, points, camera, use, noise_px, draws, detector)
    stages.run_estimate(_open(folder), [setting], workers, Console(quiet=quiet))


@app.command(epilog="Example: python -m pipelines score out/demo")
def score(folder: Folder, workers: Workers = 1, quiet: Quiet = False) -> None:
    """Score every estimate against the truth."""
    from pipelines import stages

    stages.run_score(_open(folder), workers, Console(quiet=quiet))


@app.command(epilog="Example: python -m pipelines report out/demo")
def report(folder: Folder) -> None:
    """Write report.html."""
    from pipelines.report.page import write_report

    typer.echo(f"report: {write_report(_open(folder))}")


@app.command(epilog="Example: python -m pipelines demo --out out/demo")
def demo(out: Out = Path("out/demo"), regime: Regime = None, workers: Workers = 1, quiet: Quiet = False) -> None:
    """Run the recipe `demo`: 40 images, five lenses, a report."""
    run("demo", out, regime=regime, workers=workers, quiet=quiet)


@app.command(epilog="Example: python -m pipelines verify out/demo")
def verify(folder: Folder) -> None:
    """Check every shard and master, and print the hash of the content."""
    from pipelines.verify import verify as check

    digest, problems = check(_open(folder))
    if problems:
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        raise UserError(f"{problems[0]}{more}")
    typer.echo(f"content {digest}")


@app.command(epilog="Example: python -m pipelines doctor")
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


@app.command(epilog="Example: python -m pipelines bench demo --only render --only solver --out bench.md")
def bench(
    recipe: RecipeName = "demo",
    poses: Annotated[int, typer.Option(min=1, help="Poses measured with each camera.")] = 2,
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="A part: render, stages, profile, frame, equal, detection, solver, growth, or blender, which `make "
            "bench-blender` sets up; may be given again."
        ),
    ] = None,
    memory: Annotated[
        int | None, typer.Option(min=1, help="Instead, generate and detect so many frames and tell the memory.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Write the table as Markdown, too.")] = None,
    regime: Regime = None,
) -> None:
    """Speed as ratios measured side by side, and memory over a long run."""
    from pipelines.bench.command import bench as measure

    measure(_load(recipe, regime)[0], poses, only or [], memory, out)


@app.command(epilog="Example: python -m pipelines recipes")
def recipes() -> None:
    """List the recipes that come with the package."""
    from datasets.plan import frame_count
    from datasets.recipe import load_recipe, recipe_names

    table = Table(box=None)
    for title in ("name", "frames", "description"):
        table.add_column(title)
    for name in recipe_names():
        recipe, _ = load_recipe(name)
        table.add_row(name, str(frame_count(recipe)), recipe.description)
    Console().print(table)


@app.command(epilog="Example: python -m pipelines describe demo")
def describe(
    recipe: Annotated[str | None, typer.Argument(metavar="[RECIPE]", help="Show its values beside the keys.")] = None,
) -> None:
    """Every key of a recipe with its meaning: its defaults and the sensor's regimes, or a recipe's values."""
    from datasets.recipe import describe as keys
    from datasets.recipe import load_recipe, values
    from render.regimes import regime_rows, regimes

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


def _load(recipe: str, regime: str | None) -> tuple[Any, str]:
    """A recipe and its text, with another regime if one is given."""
    from datasets.override import with_regime
    from datasets.recipe import load_recipe, parse_recipe

    loaded, text = load_recipe(recipe)
    if regime is None:
        return loaded, text
    text = with_regime(text, regime, recipe)
    return parse_recipe(text, f"recipe {recipe} with --regime {regime}"), text


def _claim(recipe: str, out: Path, regime: str | None, masters: Path | None, console: Console) -> Any:
    from datasets.plan import plan
    from datasets.store import claim, open_dataset

    loaded, text = _load(recipe, regime)
    plan(loaded)
    if masters is not None:
        open_dataset(masters)  # before anything is written
    dataset = claim(out, loaded, text)
    if masters is not None:
        from pipelines.borrow import borrow_masters

        taken, lacking = borrow_masters(dataset, masters)
        console.print(f"masters: {taken} of {lacking} taken from {masters}; the rest is rendered")
    return dataset


def _open(folder: Path) -> Any:
    from datasets.store import open_dataset

    return open_dataset(folder)
=======
app = command_line()
>>>>>>> wt-systems


def guarded(command: Callable[[], Any]) -> int:
    """Run a command; an expected error becomes one sentence on stderr and exit code 2."""
    try:
        command()
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 1
    except KeyboardInterrupt:
        print("stopped; run the same command again to go on", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        from render.backend import BackendError

        if isinstance(error, UserError | BackendError):
            print(f"error: {error}", file=sys.stderr)
            return USER_ERROR
        if isinstance(error, PermissionError):
            print(f"error: cannot use {error.filename}: this user has no permission; ask its owner", file=sys.stderr)
            return USER_ERROR
        if isinstance(error, BrokenPipeError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0
        raise
    return 0


def main() -> int:
    """Entry point of `python -m pipelines`."""
    return guarded(app)

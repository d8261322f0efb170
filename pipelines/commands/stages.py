"""The stages as commands."""

from __future__ import annotations

from pathlib import Path

import typer
from rich.console import Console

from pipelines.commands import options as o
from pipelines.commands.opening import begin, opened


def run(
    recipe: o.RecipeName,
    out: o.Out,
    regime: o.Regime = None,
    masters: o.Masters = None,
    workers: o.Workers = 1,
    quiet: o.Quiet = False,
) -> None:
    """Every stage: generate, detect, estimate, score, report."""
    from pipelines import stages

    console = Console(quiet=quiet)
    dataset = begin(recipe, out, regime, masters, console)
    stages.run_generate(dataset, workers, console)
    stages.run_detect(dataset, workers, console)
    stages.run_estimate(dataset, stages.RUN_SETTINGS, workers, console)
    stages.run_score(dataset, workers, console)
    report(out)


def demo(
    out: o.Out = Path("out/demo"), regime: o.Regime = None, workers: o.Workers = 1, quiet: o.Quiet = False
) -> None:
    """Run the recipe `demo`: 40 images, five lenses, a report."""
    run("demo", out, regime=regime, workers=workers, quiet=quiet)


def generate(
    recipe: o.RecipeName,
    out: o.Out,
    regime: o.Regime = None,
    masters: o.Masters = None,
    workers: o.Workers = 1,
    quiet: o.Quiet = False,
) -> None:
    """Render images with their truth."""
    from pipelines import stages

    console = Console(quiet=quiet)
    stages.run_generate(begin(recipe, out, regime, masters, console), workers, console)


def detect(
    folder: o.Folder, detector: o.DetectorName = "edge-fit", workers: o.Workers = 1, quiet: o.Quiet = False
) -> None:
    """Find corners and circle in the images; each detector's points stay beside the others'."""
    from pipelines import stages

    stages.run_detect(opened(folder), workers, Console(quiet=quiet), detector)


def estimate(
    folder: o.Folder,
    solver: o.SolverName = "best",
    points: o.PointsName = "detected",
    camera: o.CameraName = "exact",
    use: o.Use = "all",
    noise_px: o.NoisePx = 0.4,
    draws: o.Draws = 5,
    detector: o.DetectorName = "edge-fit",
    workers: o.Workers = 1,
    quiet: o.Quiet = False,
) -> None:
    """Estimate poses; nothing is rendered again."""
    from pipelines import stages
    from pipelines.estimate import Setting

    setting = Setting(solver, points, camera, use, noise_px, draws, detector)
    stages.run_estimate(opened(folder), [setting], workers, Console(quiet=quiet))


def score(folder: o.Folder, workers: o.Workers = 1, quiet: o.Quiet = False) -> None:
    """Score every estimate against the truth."""
    from pipelines import stages

    stages.run_score(opened(folder), workers, Console(quiet=quiet))


def report(folder: o.Folder) -> None:
    """Write report.html."""
    from pipelines.report.page import write_report

    typer.echo(f"report: {write_report(opened(folder))}")

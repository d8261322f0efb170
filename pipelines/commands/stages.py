"""The stages as commands."""

from __future__ import annotations

from pathlib import Path

import typer
from rich.console import Console

from datasets.errors import UserError
from pipelines.commands import options as o
from pipelines.commands.opening import begin, opened, writing


def run(
    recipe: o.RecipeName,
    out: o.Out,
    regime: o.Regime = None,
    reuse: o.Reuse = None,
    solver: o.MoreSolvers = None,
    workers: o.Workers = 1,
    quiet: o.Quiet = False,
) -> None:
    """Every stage: generate, detect, estimate, score, report."""
    from pipelines.stages import run as stages
    from pipelines.stages.settings import RUN_SETTINGS, settings_of

    console = Console(quiet=quiet)
    settings = [*RUN_SETTINGS, *settings_of(solver or [])]
    with begin(recipe, out, regime, reuse, console) as dataset:
        stages.run_generate(dataset, workers, console)
        stages.run_detect(dataset, workers, console)
        stages.run_estimate(dataset, settings, workers, console)
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
    reuse: o.Reuse = None,
    workers: o.Workers = 1,
    quiet: o.Quiet = False,
) -> None:
    """Render images with their truth."""
    from pipelines.stages import run as stages

    console = Console(quiet=quiet)
    with begin(recipe, out, regime, reuse, console) as dataset:
        stages.run_generate(dataset, workers, console)


def detect(
    folder: o.Folder, detector: o.DetectorName = "edge-fit", workers: o.Workers = 1, quiet: o.Quiet = False
) -> None:
    """Find corners and circle in the images; each detector's points stay beside the others'."""
    from pipelines.stages import run as stages

    with writing(folder) as dataset:
        stages.run_detect(dataset, workers, Console(quiet=quiet), detector)


def estimate(
    folder: o.Folder,
    solver: o.SolverName = None,
    estimator: o.Estimator = None,
    points: o.PointsName = "detected",
    camera: o.CameraName = "exact",
    use: o.Use = "all",
    noise_px: o.NoisePx = 0.4,
    draws: o.Draws = 5,
    detector: o.DetectorName = "edge-fit",
    overwrite: o.Overwrite = False,
    workers: o.Workers = 1,
    quiet: o.Quiet = False,
) -> None:
    """Estimate poses with a solver, or with your own function; nothing is rendered again."""
    from pipelines.stages import run as stages
    from pipelines.stages.settings import Setting, System

    setting = Setting("best" if solver is None else solver, points, camera, use, noise_px, draws, detector)
    console = Console(quiet=quiet)
    if estimator is None:
        with writing(folder) as dataset:
            stages.run_estimate(dataset, [setting], workers, console, overwrite=overwrite)
        return
    if solver is not None or setting != Setting(camera=camera):
        raise UserError("--estimator is given images: leave out --solver and the options that choose points")
    with writing(folder) as dataset:
        stages.run_system(dataset, System(estimator, camera), workers, console, overwrite=overwrite)


def score(
    folder: o.Folder,
    poses: o.PoseFile = None,
    name: o.PosesName = None,
    camera: o.CameraName = "exact",
    workers: o.Workers = 1,
    quiet: o.Quiet = False,
) -> None:
    """Score every estimate, and the poses of a file, against the truth."""
    from pipelines.stages import run as stages
    from pipelines.stages.settings import System

    if (poses is None) != (name is None):
        raise UserError("--poses and --name go together; give a file of poses and what to call them, or neither")
    if poses is None and camera != "exact":
        raise UserError("--camera goes with --poses; leave it out, or give a file of poses")
    console = Console(quiet=quiet)
    with writing(folder) as dataset:
        if poses is not None and name is not None:
            stages.run_import(dataset, poses, System(name, camera), console)
        stages.run_score(dataset, workers, console)


def report(folder: o.Folder) -> None:
    """Write report.html."""
    from pipelines.report.page import write_report

    typer.echo(f"report: {write_report(opened(folder))}")

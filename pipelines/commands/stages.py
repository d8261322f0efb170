"""The stages as commands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.console import Console

from datasets.errors import UserError
from pipelines.commands import options as o
from pipelines.commands.opening import begin, complete_manifest, finish, kept_by, load, opened, writing
from pipelines.engines.choice import engine_of
from pipelines.stages.part import part_of

if TYPE_CHECKING:
    from datasets.store.dataset import Dataset
    from pipelines.stages.missing import Execution

ROOM = "room"  # folder in the demo's of its board in a room


def run(
    recipe: o.RecipeName,
    out: o.Out,
    regime: o.Regime = None,
    reuse: o.Reuse = None,
    no_masters: o.NoMasters = False,
    pack_masters: o.PackMasters = False,
    ignore_disk: o.IgnoreDisk = False,
    solver: o.MoreSolvers = None,
    estimator: o.MoreEstimators = None,
    timeout: o.Timeout = 300.0,
    memory_mb: o.MemoryMb = 1500,
    detect_seconds: o.DetectSeconds = 2.0,
    workers: o.Workers = 1,
    engine: o.EngineName = "local",
    ray_address: o.RayAddress = None,
    shard: o.Shard = None,
    quiet: o.Quiet = False,
) -> None:
    """Every stage: generate, detect, estimate, score, report; with --estimator photometric the pixels' bound, too."""
    from pipelines.cost.before import ALL_STAGES, Start, tell_cost
    from pipelines.stages import run as stages
    from pipelines.stages.estimate import solver_of
    from pipelines.stages.estimate_images import OWN_SYSTEMS, estimator_of
    from pipelines.stages.kernels import compiled_ahead
    from pipelines.stages.settings import System, run_settings, settings_of

    execution = _execution(engine, workers, ray_address, shard, quiet, (timeout, memory_mb), detect_seconds)
    more, systems = settings_of(solver or []), estimator or []
    for name in solver or []:
        solver_of(name, limits=execution.limits)  # what cannot be called is told before anything is rendered
    for name in systems:
        estimator_of(name, execution.limits)
    kept, loaded = kept_by(no_masters, pack_masters), load(recipe, regime)
    tell_cost(loaded[0], out, execution, Start(workers, ALL_STAGES, kept, ignore_disk))
    with begin(loaded, out, reuse, execution, kept) as dataset:
        with compiled_ahead(dataset, execution.part) as kernels:  # beside the first pictures
            stages.run_generate(dataset, execution)
            stages.run_detect(dataset, execution, kernels=kernels)
        stages.run_estimate(dataset, [*run_settings(dataset.recipe.target), *more], execution)
        for name in systems:
            stages.run_system(dataset, System(name), execution)
        if any(name in OWN_SYSTEMS for name in systems):
            stages.run_bound(dataset, execution)
        stages.run_score(dataset, execution)
        finish(execution)
        part = execution.part
        if part.is_whole:
            _report(dataset)
        else:
            told = (
                f"part {part.number} of {part.count} is done; after the last one, `report {out}` completes the dataset"
            )
            execution.console.print(told, soft_wrap=True)


def demo(
    out: o.Out = Path("out/demo"),
    regime: o.Regime = None,
    workers: o.Workers = 1,
    engine: o.EngineName = "local",
    ray_address: o.RayAddress = None,
    quiet: o.Quiet = False,
) -> None:
    """Run the recipes `demo` and, in its folder, `demo-room`: 50 images, five lenses, one report with both."""
    for recipe, folder in (("demo", out), ("demo-room", out / ROOM)):
        run(recipe, folder, regime=regime, workers=workers, engine=engine, ray_address=ray_address, quiet=quiet)
    _report(opened(out))


def generate(
    recipe: o.RecipeName,
    out: o.Out,
    regime: o.Regime = None,
    reuse: o.Reuse = None,
    no_masters: o.NoMasters = False,
    pack_masters: o.PackMasters = False,
    ignore_disk: o.IgnoreDisk = False,
    workers: o.Workers = 1,
    engine: o.EngineName = "local",
    ray_address: o.RayAddress = None,
    shard: o.Shard = None,
    quiet: o.Quiet = False,
) -> None:
    """Render images with their truth."""
    from pipelines.cost.before import Start, tell_cost
    from pipelines.stages import run as stages

    execution = _execution(engine, workers, ray_address, shard, quiet)
    kept, loaded = kept_by(no_masters, pack_masters), load(recipe, regime)
    tell_cost(loaded[0], out, execution, Start(workers, ("generate",), kept, ignore_disk))
    with begin(loaded, out, reuse, execution, kept) as dataset:
        stages.run_generate(dataset, execution)
        finish(execution)


def detect(
    folder: o.Folder,
    detector: o.DetectorName = "edge-fit",
    detect_seconds: o.DetectSeconds = 2.0,
    workers: o.Workers = 1,
    engine: o.EngineName = "local",
    ray_address: o.RayAddress = None,
    shard: o.Shard = None,
    quiet: o.Quiet = False,
) -> None:
    """Find corners and circle in the images; each detector's points stay beside the others'."""
    from pipelines.stages import run as stages

    execution = _execution(engine, workers, ray_address, shard, quiet, detect_seconds=detect_seconds)
    with writing(folder, shared=not execution.part.is_whole) as dataset:
        stages.run_detect(dataset, execution, detector)
        finish(execution)


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
    timeout: o.Timeout = 300.0,
    memory_mb: o.MemoryMb = 1500,
    workers: o.Workers = 1,
    engine: o.EngineName = "local",
    ray_address: o.RayAddress = None,
    shard: o.Shard = None,
    quiet: o.Quiet = False,
) -> None:
    """Estimate poses with a solver, or with your own function; nothing is rendered again."""
    from pipelines.stages import run as stages
    from pipelines.stages.settings import Setting, System

    setting = Setting("best" if solver is None else solver, points, camera, use, noise_px, draws, detector)
    execution = _execution(engine, workers, ray_address, shard, quiet, (timeout, memory_mb))
    if estimator is None:
        with writing(folder, shared=not execution.part.is_whole) as dataset:
            stages.run_estimate(dataset, [setting], execution, overwrite=overwrite)
            finish(execution)
        return
    if solver is not None or setting != Setting(camera=camera):
        raise UserError("--estimator is given images: leave out --solver and the options that choose points")
    with writing(folder, shared=not execution.part.is_whole) as dataset:
        stages.run_system(dataset, System(estimator, camera), execution, overwrite=overwrite)
        finish(execution)


def score(
    folder: o.Folder,
    poses: o.PoseFile = None,
    name: o.PosesName = None,
    pose_format: o.PoseFormat = "table",
    camera: o.CameraName = "exact",
    workers: o.Workers = 1,
    engine: o.EngineName = "local",
    ray_address: o.RayAddress = None,
    shard: o.Shard = None,
    quiet: o.Quiet = False,
) -> None:
    """Score every estimate, and the poses of a file, against the truth."""
    from pipelines.stages import run as stages
    from pipelines.stages.settings import System

    if (poses is None) != (name is None):
        raise UserError("--poses and --name go together; give a file of poses and what to call them, or neither")
    if poses is None and camera != "exact":
        raise UserError("--camera goes with --poses; leave it out, or give a file of poses")
    if poses is None and pose_format != "table":
        raise UserError("--pose-format goes with --poses; leave it out, or give a file of poses")
    if poses is not None and shard is not None:
        raise UserError("--poses takes a file as a whole; leave out --shard")
    execution = _execution(engine, workers, ray_address, shard, quiet)
    with writing(folder, shared=not execution.part.is_whole) as dataset:
        if poses is not None and name is not None:
            stages.run_import(dataset, poses, System(name, camera), execution, pose_format)
        stages.run_score(dataset, execution)
        finish(execution)


def bound(
    folder: o.Folder,
    workers: o.Workers = 1,
    engine: o.EngineName = "local",
    ray_address: o.RayAddress = None,
    shard: o.Shard = None,
    quiet: o.Quiet = False,
) -> None:
    """Compute the least errors that the pixels allow; the report then shows every solver's beside them."""
    from pipelines.stages import run as stages

    execution = _execution(engine, workers, ray_address, shard, quiet)
    with writing(folder, shared=not execution.part.is_whole) as dataset:
        stages.run_bound(dataset, execution)
        finish(execution)


def repair(
    folder: o.Folder,
    workers: o.Workers = 1,
    engine: o.EngineName = "local",
    ray_address: o.RayAddress = None,
    quiet: o.Quiet = False,
) -> None:
    """Make again what is damaged or missing, and nothing else; what is replaced is kept in DIR/quarantine."""
    from datasets.verify.recipe import restore_recipe
    from pipelines.stages.repair import repair as repaired

    execution = _execution(engine, workers, ray_address, None, quiet)
    if restore_recipe(folder):
        typer.echo(f"{folder / 'recipe.toml'} is the one again that this dataset was made from")
    with writing(folder) as dataset:
        aside, left = repaired(dataset, execution)
        finish(execution)
    for path in aside:
        typer.echo(f"put aside: {path}")
    if left:
        raise UserError("\nerror: ".join(item.text for item in left))
    typer.echo(f"{folder} is sound")


def report(folder: o.Folder) -> None:
    """Write report.html, and the manifest of what parts of a run have made."""
    dataset = opened(folder)
    _report(dataset)
    complete_manifest(dataset)


def frame(folder: o.Folder, frame_id: o.FrameNumber, out: o.Png = Path("frame.png")) -> None:
    """Make one picture of a dataset again, into a PNG, and tell what this code finds in it."""
    from pipelines.commands.pictures import show
    from pipelines.stages.one_frame import remake

    recipe = opened(folder).recipe
    show(remake(recipe, frame_id, f"dataset {folder}"), out, f"frame {frame_id} of {folder}")


def _execution(
    engine: str,
    workers: int,
    ray_address: str | None,
    shard: str | None,
    quiet: bool,
    limits: tuple[float, int] = (300.0, 1500),
    detect_seconds: float = 2.0,
) -> Execution:
    """What the options about where and how much mean. limits: seconds and MB of a user's function.

    Raises:
        UserError: a part, an engine or a limit that is not usable.
    """
    from pipelines.adapters.limits import Limits
    from pipelines.stages.missing import Execution
    from pipelines.stages.settings import check_detect_seconds

    given = Limits(*limits)
    check_detect_seconds(detect_seconds)
    part = part_of(shard)
    place = engine_of(engine, workers, ray_address)
    return Execution(place, Console(quiet=quiet), part, limits=given, detect_seconds=detect_seconds, goes_on=True)


def _report(dataset: Dataset) -> None:
    from pipelines.report.page import write_report

    typer.echo(f"report: {write_report(dataset)}")

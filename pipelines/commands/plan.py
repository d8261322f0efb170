"""The command `plan`: what a dataset costs before it is made."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from datasets.errors import UserError
from pipelines.commands import options as o
from pipelines.commands.tables import Column, print_json, print_table

MANY_SHARDS, USUAL_SHARD_FRAMES = 10_000, 1000
MOST_WORKERS = 1_000_000  # of a cluster, all machines together
MANY_FILES = 1_000_000  # in one folder, beyond which listing and copying it take minutes

if TYPE_CHECKING:
    from datasets.recipe.model import Recipe
    from pipelines.cost.forecast import Forecast


def plan(
    recipe: o.RecipeName,
    frames: o.Frames = None,
    workers: o.Workers = 1,
    no_masters: o.NoMasters = False,
    pack_masters: o.PackMasters = False,
    measure: o.Measure = False,
    json: o.Json = False,
) -> None:
    """Tell what `run` would take, for any number of frames: shards, files, bytes, time and memory; nothing is made.

    The figures are those that `--measure` took on this machine for such frames, else another machine's.
    """
    from datasets.plan import frame_count
    from datasets.recipe.model import load_recipe
    from pipelines.commands.opening import kept_by
    from pipelines.cost.choice import forecast_of

    kept, loaded = kept_by(no_masters, pack_masters), load_recipe(recipe)[0]
    if not 1 <= workers <= MOST_WORKERS:
        raise UserError(f"{workers} workers are not usable; give --workers from 1 to {MOST_WORKERS}")
    count = frame_count(loaded) if frames is None else _count(frames)
    if measure:
        _measure(loaded)
    found = forecast_of(loaded, frames=count, workers=workers, kept=kept)
    if json:
        print_json(_as_json(loaded, found))
    else:
        _print(loaded, found)


def _count(text: str) -> int:
    """The number that `--frames` means, as 250000 or 1e9.

    Raises:
        UserError: no whole number, or out of range.
    """
    from pipelines.cost.forecast import MOST_FRAMES

    try:
        number = float(text)
        if 1.0 <= number <= MOST_FRAMES and number == int(number):
            return int(number)
    except (ValueError, OverflowError):
        pass
    raise UserError(f"--frames {text} is not usable; give a whole number from 1 to {MOST_FRAMES:.0e}, as 250000 or 1e9")


def _measure(recipe: Recipe) -> None:
    from pipelines.cost.figures import keep_figures
    from pipelines.cost.measure import measure

    path = keep_figures(recipe, measure(recipe))
    typer.echo(f"measured figures are kept in {path}" if path else "no folder takes the measured figures", err=True)


def _as_json(recipe: Recipe, found: Forecast) -> dict[str, object]:
    return {
        "recipe": recipe.name,
        "frames": found.frames,
        "workers": found.workers,
        "shards": found.shards,
        "shard_frames": found.shard_frames,
        "files": found.files,
        "bytes": {name: round(value) for name, value in found.bytes.items()},
        "total_bytes": round(found.total_bytes),
        "stage_seconds": dict(found.stage_seconds),
        "seconds": found.seconds,
        "worker_mb": round(found.worker_mb),
        "figures": found.source,
    }


def _print(recipe: Recipe, found: Forecast) -> None:
    from datasets.store.kept_masters import Kept
    from pipelines.cost.forecast import lasting, sized

    frames = found.frames
    times = [*found.stage_seconds.items(), ("all stages", found.seconds)]
    sizes = [*found.bytes.items(), ("all files", found.total_bytes)]
    rows = [(name, lasting(spent * found.workers / frames), lasting(spent)) for name, spent in times]
    rows += [(name, sized(value / frames), sized(value)) for name, value in sizes if value]
    typer.echo(
        f"{recipe.name}: {frames} frames in {found.shards} shards of {found.shard_frames}, {found.files} files\n"
    )
    all_of_it = f"all, {found.workers} {'worker' if found.workers == 1 else 'workers'}"
    print_table((Column("what"), Column("a frame", number=True), Column(all_of_it, number=True)), rows)
    typer.echo(f"\nmemory of each worker: {sized(found.worker_mb * 2**20)}; each is taken to have a core of its own")
    if found.shards > MANY_SHARDS and found.shard_frames < USUAL_SHARD_FRAMES:
        fewer = -(-frames // USUAL_SHARD_FRAMES)
        typer.echo(f"shard_frames = {USUAL_SHARD_FRAMES} in the recipe would make {fewer} shards")
    if found.bytes.get("masters") and found.kept is Kept.FILES and frames > MANY_FILES:
        told = "--pack-masters puts those of a shard in one, --no-masters leaves them out"
        typer.echo(f"each frame's linear image is a file of its own, in one folder; {told}")
    typer.echo(f"from {found.source}")

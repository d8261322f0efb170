"""Choose parts of the benchmark and measure them behind a progress bar."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from rich.console import Console
from rich.progress import Progress

from datasets.errors import UserError
from datasets.recipe.model import Recipe
from pipelines.bench import (
    blender,
    detection,
    end_to_end,
    equal_accuracy,
    frame,
    memory,
    methods,
    primary_rays,
    profile,
    scaling,
    solvers,
)
from pipelines.bench.poses import measure as single_poses
from pipelines.bench.table import Row

Part = Callable[[Recipe, int], Iterator[Row]]
OPTIONAL = ("blender",)  # needs what setup does not install: measured only where it is asked for


def parts() -> dict[str, Part]:
    """The parts by name, in the order of the table: a new one is a file with a `measure` and a line here."""
    return {
        "render": primary_rays.measure,
        "stages": end_to_end.measure,
        "frame": frame.measure,
        "methods": methods.measure,
        "profile": profile.measure,
        "equal": equal_accuracy.measure,
        "detection": detection.measure,
        "solver": solvers.measure,
        "poses": single_poses,
        "growth": scaling.measure,
        "blender": blender.measure,
    }


def measured(recipe: Recipe, poses: int, only: Sequence[str], memory_frames: int | None) -> list[Row]:
    """Measure; progress goes to stderr.

    only: names of parts; all but the optional ones if empty. memory_frames: measure the memory over so many frames
    instead.
    Raises:
        UserError: an unknown part.
    """
    known, rows = parts(), list[Row]()
    for name in only:
        if name not in known:
            raise UserError(f"unknown part {name!r}; choose one of {', '.join(known)}")
    console = Console(stderr=True)  # stdout is the table's; a log or a pipe wants no bar, and an error stands alone
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        if memory_frames is not None:
            bar = progress.add_task("memory", total=memory_frames)
            return list(memory.measure(recipe, memory_frames, lambda done: progress.advance(bar, done)))
        chosen = [name for name in known if (name in only if only else name not in OPTIONAL)]
        bar = progress.add_task("", total=len(chosen))
        for name in chosen:
            progress.update(bar, description=name)
            for row in known[name](recipe, poses):
                rows.append(row)
                progress.update(bar, description=f"{name}: {row.ours}")
            progress.advance(bar)
    return rows

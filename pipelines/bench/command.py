"""Choose parts, measure them behind a progress bar, print one table and write it as Markdown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from datasets.errors import UserError
from datasets.recipe.model import Recipe
from datasets.store.atomic import write_text
from pipelines.bench import blender, memory, profile
from pipelines.bench import detection as finders
from pipelines.bench import end_to_end as whole
from pipelines.bench import equal_accuracy as equal
from pipelines.bench import frame as frames
from pipelines.bench import primary_rays as rays
from pipelines.bench import scaling as growth
from pipelines.bench import solvers as solver
from pipelines.bench.machine import facts, one_line
from pipelines.bench.table import Row, markdown, terminal

Part = Callable[[Recipe, int], Iterator[Row]]
OPTIONAL = ("blender",)  # needs what setup does not install: measured only where it is asked for


def parts() -> dict[str, Part]:
    """The parts by name, in the order of the table: a new one is a file with a `measure` and a line here."""
    return {
        "render": rays.measure,
        "stages": whole.measure,
        "frame": frames.measure,
        "profile": profile.measure,
        "equal": equal.measure,
        "detection": finders.measure,
        "solver": solver.measure,
        "growth": growth.measure,
        "blender": blender.measure,
    }


def bench(recipe: Recipe, poses: int, only: Sequence[str], memory_frames: int | None, out: Path | None) -> None:
    """Measure and show.

    only: names of parts; all but the optional ones if empty. memory_frames: measure the memory over so many frames
    instead.
    Raises:
        UserError: an unknown part, or a file that cannot be written.
    """
    known = parts()
    for name in only:
        if name not in known:
            raise UserError(f"unknown part {name!r}; choose one of {', '.join(known)}")
    console, rows = Console(), list[Row]()
    with Progress(console=console) as progress:
        if memory_frames is not None:
            bar = progress.add_task("memory", total=memory_frames)
            rows += memory.measure(recipe, memory_frames, lambda done: progress.advance(bar, done))
        else:
            chosen = [name for name in known if (name in only if only else name not in OPTIONAL)]
            bar = progress.add_task("", total=len(chosen))
            for name in chosen:
                progress.update(bar, description=name)
                for row in known[name](recipe, poses):
                    rows.append(row)
                    progress.update(bar, description=f"{name}: {row.ours}")
                progress.advance(bar)
    console.print(terminal(rows, one_line()))
    if out is not None:
        write_text(out, markdown(rows, facts()))

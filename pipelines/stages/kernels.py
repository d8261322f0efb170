"""Detection's compiled functions as a step of a run: begun early, and waited for with a bar that says so."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from datasets.plan import shard_count
from datasets.store.dataset import Dataset
from pipelines.detection import Detector
from pipelines.stages import detect
from pipelines.stages.part import Part

if TYPE_CHECKING:
    from pipelines.detection.prepare import Kernels

WAITING = "detect: compiling its functions, on first use only"


@contextmanager
def compiled_ahead(
    dataset: Dataset, part: Part, detector: str = Detector.EDGE_FIT, begun: Kernels | None = None
) -> Iterator[Kernels | None]:
    """While the body runs, what detection needs is compiled or loaded; nothing if no shard of the part is missing.

    begun: what has begun already, to go on with.
    """
    shards = part.indices(shard_count(dataset.recipe))
    if begun is not None or all(detect.is_done(dataset, index, detector) for index in shards):
        yield begun
        return
    from pipelines.detection.prepare import Kernels

    with Kernels() as kernels:
        yield kernels


def wait_for(kernels: Kernels | None, console: Console) -> None:
    """Wait until all are ready; where that takes seconds, a bar says what for."""
    if kernels is None:
        return
    columns, silent = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()), console.quiet
    with Progress(*columns, console=console, disable=silent or not kernels.must_compile()) as progress:
        progress.add_task(WAITING, total=None)
        kernels.finish()

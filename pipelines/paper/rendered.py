"""The simulation on rendered pictures: the recipe `paper`, detected, estimated and scored by the pipeline itself."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
from rich.console import Console

from datasets.recipe.model import load_recipe
from datasets.rows import numbers
from datasets.store.claim import claim
from datasets.store.dataset import Dataset
from datasets.store.lock import hold
from eposit import Status
from eposit.arrays import Array
from pipelines.engines.engine import Engine
from pipelines.machine import provenance
from pipelines.pages.sections import Table
from pipelines.paper.beyond.field_images import field_of_images
from pipelines.paper.claims import PaperSection
from pipelines.paper.simulation import COMPONENTS, LENSES, UNITS
from pipelines.stages.missing import Execution
from pipelines.stages.run import run_detect, run_estimate, run_generate, run_score
from pipelines.stages.settings import Setting
from pipelines.statistics import bootstrap, mean, median

RECIPE = "paper"
SETTINGS = (
    Setting(solver="eposit", use="four", camera="paper"),
    Setting(solver="released", use="four", camera="paper"),
    Setting(solver="eposit", use="four"),
    Setting(use="four"),
    Setting(),
)
COLUMNS = tuple(f"{name}_error_deg" for name in COMPONENTS[:3]) + tuple(f"t{name}_error_mm" for name in COMPONENTS[3:])
HEAD = (
    "camera",
    "solver",
    "frames",
    "no pose",
    *(f"{name}, {unit}" for name, unit in zip(COMPONENTS, UNITS, strict=True)),
)


def images(folder: Path, engine: Engine, tell: Callable[[str], None]) -> PaperSection:
    """Mean errors and medians of |error| on rendered pictures.

    Raises:
        UserError: the folder holds something else, or the disk refuses.
    """
    dataset, execution = pictures(RECIPE, folder, engine, tell), Execution(engine, Console(quiet=True))
    tell("images: estimates")
    with hold(dataset.root):
        run_estimate(dataset, SETTINGS, execution)
        run_score(dataset, execution)
    scores, cameras = dataset.read("scores"), dataset.read("frames", ["frame_id", "camera_name"])
    tables = tuple(
        _table(scores, cameras, title, take) for title, take in (("Mean errors", _mean), ("Medians", _median))
    )
    intro = (
        "The paper's object as a board of 5 x 4 squares, its circle 50 mm high in the place of the fourth point, "
        "rendered through the five lenses. Detection is far better than the paper's 0.4 px, so that what is left is "
        "the bias of the assumed camera. At large tilts so high a circle is seen over the edge of a square or of the "
        "board; where it is not found, four points give no pose."
    )
    return PaperSection("On rendered pictures", intro, tables)


def wide(folder: Path, engine: Engine, tell: Callable[[str], None]) -> PaperSection:
    """Success against field angle on the pictures of the recipe `wide`.

    Raises:
        UserError: the folder holds something else, or the disk refuses.
    """
    pictures("wide", folder, engine, tell)
    tell("wide: poses")
    return field_of_images(folder)


def pictures(name: str, folder: Path, engine: Engine, tell: Callable[[str], None]) -> Dataset:
    """The dataset of a recipe that comes along, rendered and detected; what is there is kept."""
    recipe, text = load_recipe(name)
    execution = Execution(engine, Console(quiet=True))
    with claim(folder, recipe, text, provenance=provenance()) as dataset:
        tell(f"{name}: rendering")
        run_generate(dataset, execution)
        tell(f"{name}: detection")
        run_detect(dataset, execution)
    return dataset


def _table(scores: pa.Table, cameras: pa.Table, title: str, cell: Callable[[Array], str]) -> Table:
    names = dict(zip(cameras["frame_id"].to_pylist(), cameras["camera_name"].to_pylist(), strict=True))
    camera = np.array([names[frame] for frame in scores["frame_id"].to_pylist()])
    key = np.array(
        [
            f"{s} {c} {u}"
            for s, c, u in zip(*(scores[k].to_pylist() for k in ("solver", "assumed_camera", "point_set")), strict=True)
        ]
    )
    failed = np.array([status != Status.OK for status in scores["status"].to_pylist()])
    values = numbers(scores, *COLUMNS)
    rows: list[tuple[str, ...]] = []
    for lens in LENSES:
        for setting in SETTINGS:
            name = f"{setting.solver} {setting.camera} {setting.use}"
            own = (camera == lens) & (key == name)
            cells = (cell(values[own, k]) for k in range(6))
            rows.append((lens, name, str(int(own.sum())), str(int(failed[own].sum())), *cells))
    return Table(f"{title} on rendered pictures, with 95 % intervals over the frames", HEAD, tuple(rows))


def _mean(values: Array) -> str:
    return bootstrap(values, mean).text(3)


def _median(values: Array) -> str:
    return bootstrap(np.abs(values), median).text(3)

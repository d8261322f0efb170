"""Stage 5: `report.html`, one file: what was found in sentences, frames, tables, figures, and what was run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from datasets.store.atomic import write_text
from datasets.store.dataset import RECIPE_FILE, Dataset
from pipelines.detection import Detector
from pipelines.machine import versions
from pipelines.pages.sections import Drawing
from pipelines.pages.template import rendered
from pipelines.report import figures, pictures
from pipelines.report.data import Cell, Series, cells, normalised_rows
from pipelines.report.gather import gathered
from pipelines.report.pixel_bound import bound_rows
from pipelines.report.point_tables import PointTally, field_rows, tilt_rows
from pipelines.report.run import Run
from pipelines.report.scenes import scenes
from pipelines.report.summary import summarised
from pipelines.report.tables import bound_table, field_table, normalised_table
from pipelines.statistics import LEAST_FOR_TAIL

REPORT = "report.html"
TEMPLATE = Path(__file__).with_name("page.html")


def write_report(dataset: Dataset) -> Path:
    """Write the report of a dataset that has scores.

    Raises:
        UserError: a stage is missing or a shard damaged.
    """
    run, points = gathered(dataset)
    html = rendered(
        TEMPLATE,
        recipe=dataset.recipe,
        recipe_text=(dataset.root / RECIPE_FILE).read_text(encoding="utf-8"),
        frames=run.frames,
        summary=summarised(run),
        **_frames(dataset, run),
        scenes=[(scene, scene.link(REPORT)) for scene in scenes(dataset, REPORT)],
        **_detection(points, run.frames),
        **_poses(run.found, run.frames),
        bound=bound_table(bounds) if (bounds := bound_rows(dataset)) else None,
        versions=versions(),
    )
    path = dataset.root / REPORT
    write_text(path, html)
    return path


def _frames(dataset: Dataset, run: Run) -> dict[str, Any]:
    """The frames that are shown, with the points of our detector, or of the first if ours has none."""
    ours = [item for item in run.points if item.detector == Detector.EDGE_FIT]
    item = next(iter(ours or run.points), None)
    chosen = {"usual": pictures.usual(run.frames, item), "worst": pictures.worst(run.frames, item, run.found)}
    return {
        name: pictures.drawings(dataset, run.frames, own, item, large=name == "usual") for name, own in chosen.items()
    }


def _detection(points: list[PointTally], frames: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "detection": tilt_rows(points, frames),
        "detectors": len(points),
        "field": field_table(field_rows(points, frames)) if points else None,
    }


def _poses(found: list[Series], frames: list[dict[str, Any]]) -> dict[str, Any]:
    by_id = {frame["frame_id"]: frame for frame in frames}
    rows = cells(found, {frame["frame_id"]: frame["camera_name"] for frame in frames})
    normalised = normalised_rows(found)
    return {
        "cells": rows,
        "kinds": _kinds(rows),
        "tails": any(error.tail for row in rows for error in row.errors),
        "least_for_tail": LEAST_FOR_TAIL,
        "normalised": normalised_table(normalised) if normalised else None,
        "figures": [
            (
                item.name,
                Drawing("Rotation and depth error along the trajectory", figures.along_helix(item, by_id)),
                Drawing("Errors by component, a box for each camera", figures.boxes(item, by_id)),
            )
            for item in found
        ],
    }


def _kinds(rows: list[Cell]) -> list[tuple[str, str]]:
    """What the table of poses can be narrowed to, with the texts."""
    settings = dict.fromkeys(row.setting for row in rows)
    failures = [("failed", "with failures")] if any(row.failed or row.gross for row in rows) else []
    return failures + [(f"setting-{i}", name) for i, name in enumerate(settings)]

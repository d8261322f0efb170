"""Stage 5: `report.html`, self-contained: pictures, curves, boxes, tables, and what was run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from datasets.rows import decode_image, of_detector, points_by_frame
from datasets.schema import COMPONENTS
from datasets.store.atomic import write_text
from datasets.store.dataset import RECIPE_FILE, Dataset
from eposit.arrays import Array
from pipelines.detection import Detector
from pipelines.machine import versions
from pipelines.report import figures
from pipelines.report.data import ERRORS, normalised_rows, score_rows, series
from pipelines.report.points import field_rows, point_errors, tilt_rows
from pipelines.report.template import rendered
from render.targets.image_region import Region

REPORT = "report.html"
TEMPLATE = Path(__file__).with_name("page.html")
GALLERY = 15  # pictures at most


def write_report(dataset: Dataset) -> Path:
    """Write the report of a dataset that has scores.

    Raises:
        UserError: a stage is missing or a shard damaged.
    """
    columns = [
        "frame_id",
        "time_s",
        "camera_name",
        "tilt_deg",
        "cx_px",
        "cy_px",
        *(f"region_{a}_px" for a in Region._fields),
    ]
    frames = dataset.read("frames", columns).to_pylist()
    by_id = {frame["frame_id"]: frame for frame in frames}
    found = series(dataset.read("scores"))
    # Who scores a whole system of their own may have detected nothing.
    points = point_errors(dataset, frames) if dataset.shards("detections") else []
    html = rendered(
        TEMPLATE,
        recipe=dataset.recipe,
        recipe_text=(dataset.root / RECIPE_FILE).read_text(encoding="utf-8"),
        frames=frames,
        gallery=_gallery(dataset, frames),
        detection=tilt_rows(points, frames),
        field=field_rows(points, frames),
        components=COMPONENTS,
        normalised=normalised_rows(found),
        series=[
            {"name": item.name, "helix": figures.along_helix(item, by_id), "boxes": figures.boxes(item, by_id)}
            for item in found
        ],
        errors=ERRORS,
        scores=score_rows(found, {frame["frame_id"]: frame["camera_name"] for frame in frames}),
        versions=versions(),
    )
    path = dataset.root / REPORT
    write_text(path, html)
    return path


def _gallery(dataset: Dataset, frames: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Evenly chosen frames with their detected points."""
    chosen = {frames[int(i)]["frame_id"] for i in np.linspace(0, len(frames) - 1, min(GALLERY, len(frames))).round()}
    points: dict[int, Array] = {}
    if dataset.shards("detections"):
        points = points_by_frame(of_detector(dataset.read("detections"), Detector.EDGE_FIT), dataset.recipe.target)
    none = np.full((len(dataset.recipe.target.points), 2), np.nan)
    pictures: list[dict[str, Any]] = []
    for path in dataset.shards("frames"):
        ids = dataset.read_shard(path, ["frame_id"])["frame_id"].to_pylist()
        if chosen.isdisjoint(ids):
            continue
        for frame_id, image in zip(ids, dataset.read_shard(path, ["image"])["image"].to_pylist(), strict=True):
            if frame_id not in chosen:
                continue
            frame = next(frame for frame in frames if frame["frame_id"] == frame_id)
            region = Region(*(frame[f"region_{a}_px"] for a in Region._fields))
            marked = points.get(frame_id, none)
            svg = figures.picture(decode_image(image, path, frame_id), region, marked)
            found = int(np.isfinite(marked[:, 0]).sum())
            pictures.append({**frame, "svg": svg, "found": found, "total": len(marked)})
    return pictures

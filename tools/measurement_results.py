"""Figures from what the commands of a measurement have left: datasets, a page of the paper, a benchmark's JSON."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

from datasets.store.dataset import open_dataset
from eposit.arrays import Array
from pipelines.detection import Detector
from pipelines.report.data import normalised_rows, series
from pipelines.report.point_tables import LEAST_SIDE_PX, field_rows, tallied, tilt_rows
from pipelines.report.points import PointErrors, point_errors

FRAME_COLUMNS = ("frame_id", "camera_name", "tilt_deg", "cx_px", "cy_px")
MEANS = ("mean_x", "mean_y", "mean_radial", "mean_along_x")
OUR_SETTING = "best detected exact all"


@dataclass(frozen=True, slots=True)
class Results:
    """What the commands of one measurement have left."""

    folder: Path  # holds the folders that the commands name
    outputs: tuple[str, ...]  # what each command wrote to stdout, in their order

    def points(self, name: str, detector: str = Detector.EDGE_FIT) -> tuple[PointErrors, list[dict[str, Any]]]:
        """Errors of one detector's points in the dataset `name`, and the rows of its frames.

        Raises:
            UserError: no such dataset, or it is not complete.
        """
        dataset = open_dataset(self.folder / name)
        frames = dataset.read("frames", [*FRAME_COLUMNS]).to_pylist()
        (found,) = (errors for errors in point_errors(dataset, frames) if errors.detector == detector)
        return found, frames

    def corner_rows(self, name: str, detector: str = Detector.EDGE_FIT) -> list[dict[str, Any]]:
        """A row of `tilt_rows` for each camera and band of tilt of one detector.

        Raises:
            UserError: as `points`.
        """
        errors, frames = self.points(name, detector)
        return tilt_rows([tallied(errors, frames)], frames)

    def large_square_rows(self, name: str, to_deg: float) -> list[dict[str, Any]]:
        """A row of `field_rows` for each camera and angle off the axis up to `to_deg`; large local squares only.

        Raises:
            UserError: as `points`.
        """
        errors, frames = self.points(name)
        rows = field_rows([tallied(errors, frames)], frames)
        return [row for row in rows if row["side"] == f"from {LEAST_SIDE_PX:g}" and float(row["angle"]) <= to_deg]

    def pose_errors(self, name: str) -> list[float]:
        """RMS of the pose errors over their stated deviations, six components: our solver on detected points.

        Raises:
            UserError: as `points`.
        """
        rows = normalised_rows(series(open_dataset(self.folder / name).each_shard("scores")))
        (found,) = (row["rms"] for row in rows if row["setting"] == OUR_SETTING)
        return found

    def ratios(self, start: str, other: str = "", command: int = 0) -> list[float]:
        """How many of ours fit into one of the other: a benchmark's rows whose names start so.

        other: how the name of what it is compared with starts.
        """
        return [row["ratio"] for row in self._times(start, other, command)]

    def cpu_ratios(self, start: str, end: str, other: str) -> list[float]:
        """The same in processor time, which other programs disturb less: rows whose names start and end so."""
        return [row["cpu_ratio"] for row in self._times(start, other, 0) if end in row["ours"]]

    def _times(self, start: str, other: str, command: int) -> list[dict[str, Any]]:
        rows = json.loads(self.outputs[command])["times"]
        return [row for row in rows if row["ours"].startswith(start) and row["other"].startswith(other)]

    def figures(self, start: str) -> list[dict[str, str]]:
        """A benchmark's figures whose names start so."""
        return [row for row in json.loads(self.outputs[0])["figures"] if row["ours"].startswith(start)]

    def paper_rows(self, name: str, title: str) -> list[list[str]]:
        """Rows of the first table of the paper's page in the folder `name` with `title` in its caption."""
        page = _Tables()
        page.feed((self.folder / name / "paper.html").read_text(encoding="utf-8"))
        return next(rows for caption, rows in page.tables if title in caption)


class _Tables(HTMLParser):
    """The tables of a page, each with its caption; a table's head has no `td` and is left out."""

    def __init__(self) -> None:
        super().__init__()
        self.tables: list[tuple[str, list[list[str]]]] = []
        self.inside = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.inside = tag
        if tag == "table":
            self.tables.append(("", []))
        elif tag == "tr":
            self.tables[-1][1].append([])
        elif tag == "td" or (tag == "th" and ("scope", "row") in attrs):
            self.inside = "td"
            self.tables[-1][1][-1].append("")

    def handle_endtag(self, tag: str) -> None:
        self.inside = ""
        if tag == "table":
            caption, rows = self.tables.pop()
            self.tables.append((caption, [row for row in rows if row]))

    def handle_data(self, data: str) -> None:
        if self.inside == "caption":
            caption, rows = self.tables.pop()
            self.tables.append((caption + data, rows))
        elif self.inside == "td":
            self.tables[-1][1][-1][-1] += data


def pooled(errors: PointErrors) -> Array:
    """(k, 2) errors of all corners found, px."""
    corners = errors.error[:, :-1]
    return corners[np.isfinite(corners[..., 0])]


def circles(errors: PointErrors, frames: list[dict[str, Any]], without: str = "") -> Array:
    """(k, 2) errors of all circles found, px, but those of the camera `without`."""
    chosen = errors.error[np.array([frame["camera_name"] != without for frame in frames]), -1]
    return chosen[np.isfinite(chosen[:, 0])]


def rms(values: Array) -> float:
    """Root mean square over all values."""
    return float(np.sqrt(np.mean(values**2)))


def largest(rows: Iterable[dict[str, Any]], *names: str) -> float:
    """The largest absolute value of some columns."""
    return max(abs(row[name]) for row in rows for name in names)


def span(values: Iterable[float], form: str) -> str:
    """`least to largest` in a number format such as `.3f`; one number where both read alike."""
    found = [*values]
    least, most = format(min(found), form), format(max(found), form)
    return least if least == most else f"{least} to {most}"

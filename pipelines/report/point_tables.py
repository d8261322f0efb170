"""Tables of point errors by camera, tilt and field angle, from what shard after shard adds to them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.report.frame_points import FramePoints, by_frame, joined
from pipelines.report.points import PointErrors
from pipelines.report.sample import Sample
from pipelines.spread import NORMAL_MAD
from pipelines.statistics import Interval, root, student

STEEP_DEG = 45.0
ANGLE_STEP_DEG = 15.0  # of the field-angle table; each row is centred on a multiple
LEAST_SIDE_PX = 20.0  # local square below which corners stand in a row of their own


@dataclass(slots=True)
class _Corners:
    """Corners of one row of the field-angle table."""

    count: int = 0
    found: int = 0
    squares: float = 0.0  # sum over both axes, px^2
    normalised: float = 0.0  # sum of squares over both axes, NaN where a covariance is missing
    largest: float = np.nan  # px
    failures: Counter[str] = field(default_factory=Counter)

    def add(self, error: Array, normalised: Array, status: NDArray[np.str_]) -> None:
        """error and normalised: (k, 2), NaN where a corner was not found."""
        ok = np.isfinite(error[:, 0])
        self.count, self.found = self.count + len(error), self.found + int(np.sum(ok))
        self.squares += float(np.sum(error[ok] ** 2))
        self.normalised += float(np.sum(normalised[ok] ** 2))
        if np.any(ok):
            self.largest = float(np.fmax(self.largest, np.linalg.norm(error[ok], axis=1).max()))
        self.failures.update(status[~ok].tolist())


@dataclass(slots=True)
class PointTally:
    """What the report keeps of one detector's points: by frame, by field angle, and a sample for medians."""

    detector: str
    parts: list[FramePoints] = field(default_factory=list)
    fields: dict[tuple[str, float, bool], _Corners] = field(default_factory=dict)  # camera, angle, large square
    sizes: dict[tuple[str, bool], Sample] = field(default_factory=dict)  # camera, steep: errors' sizes, px

    @property
    def frames(self) -> FramePoints:
        """The frames added so far."""
        if len(self.parts) > 1:
            self.parts = [joined(self.parts)]
        return self.parts[0]

    def add(self, item: PointErrors, frames: Sequence[dict[str, Any]]) -> None:
        """Add the points of some frames. frames: their rows, with camera and tilt."""
        self.parts.append(by_frame(item))
        camera = np.array([frame["camera_name"] for frame in frames])
        steep = np.array([frame["tilt_deg"] for frame in frames]) > STEEP_DEG
        shows = item.in_image.any(axis=1)
        for name in dict.fromkeys(camera.tolist()):
            for is_steep in (False, True):
                corners = item.error[(camera == name) & (steep == is_steep) & shows, :-1]
                self.sizes.setdefault((name, is_steep), Sample()).add(np.abs(corners[np.isfinite(corners)]))
            self._add_fields(item, name, (camera == name)[:, None] & item.in_image[:, :-1])

    def _add_fields(self, item: PointErrors, camera: str, own: Mask) -> None:
        for angle, near in _angle_bands(item.theta_deg[:, :-1], own):
            for large in (True, False):
                mask = near & ((item.side_px[:, :-1] >= LEAST_SIDE_PX) == large)
                if np.any(mask):
                    row = self.fields.setdefault((camera, angle, large), _Corners())
                    row.add(item.error[:, :-1][mask], item.normalised[:, :-1][mask], item.status[:, :-1][mask])


def tallied(item: PointErrors, frames: Sequence[dict[str, Any]]) -> PointTally:
    """What the report keeps of points that are all there at once."""
    tally = PointTally(item.detector)
    tally.add(item, frames)
    return tally


def tilt_rows(points: Sequence[PointTally], frames: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Corner and circle errors for each detector and camera, tilt up to 45 degrees and beyond."""
    steep = np.array([frame["tilt_deg"] for frame in frames]) > STEEP_DEG
    camera = np.array([frame["camera_name"] for frame in frames])
    rows: list[dict[str, Any]] = []
    for item in points:
        found = item.frames
        for name in dict.fromkeys(camera.tolist()):
            for label, is_steep in ((f"up to {STEEP_DEG:g}", False), (f"beyond {STEEP_DEG:g}", True)):
                chosen = (camera == name) & (steep == is_steep)
                mask = chosen & found.shows
                made_up = int(np.sum(found.made_up[chosen]))
                if np.any(mask) or made_up:
                    told = {"detector": item.detector, "camera": name, "tilt": label, "made_up": made_up}
                    scatter = NORMAL_MAD * item.sizes[name, is_steep].median()
                    rows.append(told | _tilt_row(found, mask) | {"scatter": scatter})
    return rows


def _tilt_row(found: FramePoints, mask: Mask) -> dict[str, Any]:
    """mask: (f,) the row's frames."""
    corners, circles = found.corners[mask], mask & found.circle
    unstated = int(np.sum(corners)) > int(np.sum(found.stated[mask]))
    largest = found.largest[mask & found.boards]
    return {
        "frames": int(np.sum(mask)),
        "boards": int(np.sum(found.boards[mask])),
        "corners": int(np.sum(corners)),
        "rms": np.sqrt(_weighted(found.square[mask], corners)),
        "mean_x": _weighted(found.mean_x[mask], corners),
        "mean_y": _weighted(found.mean_y[mask], corners),
        "mean_radial": _weighted(found.mean_radial[mask], corners),
        "mean_along_x": _weighted(found.mean_along_x[mask], corners),
        "max": float(largest.max()) if len(largest) else np.nan,
        "normalised": np.nan if unstated else np.sqrt(_weighted(found.normalised[mask], found.stated[mask])),
        "circles": int(np.sum(circles)),
        "circle_rms": _root_mean(found.circle_square[circles]),
        "circle_normalised": _root_mean(found.circle_normalised[circles]),
        "rms_interval": root(student(found.square[mask])),
        "bias": bias(found, mask),
        "circle_interval": root(student(found.circle_square[mask])),
    }


def bias(found: FramePoints, frames: Mask) -> dict[str, Interval]:
    """Mean corner error of some frames along x, y and the radius, px, with intervals over the frames."""
    values = {"x": found.mean_x, "y": found.mean_y, "radius": found.mean_radial}
    return {name: student(each[frames]) for name, each in values.items()}


def field_rows(points: Sequence[PointTally], frames: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Corners in the picture by field angle and camera, large and small local squares apart."""
    order = {name: i for i, name in enumerate(dict.fromkeys(frame["camera_name"] for frame in frames))}
    rows: list[dict[str, Any]] = []
    for item in points:
        for camera, angle, large in sorted(item.fields, key=lambda key: (order[key[0]], key[1], not key[2])):
            row = item.fields[camera, angle, large]
            rows.append(
                {
                    "detector": item.detector,
                    "camera": camera,
                    "angle": f"{angle:g}",
                    "side": ("from" if large else "below") + f" {LEAST_SIDE_PX:g}",
                    "corners": row.count,
                    "found": row.found / row.count,
                    "rms": _root(row.squares, 2 * row.found),
                    "max": row.largest,
                    "normalised": _root(row.normalised, 2 * row.found),
                    "failures": ", ".join(f"{count} {name}" for name, count in sorted(row.failures.items())),
                }
            )
    return rows


def _angle_bands(theta: Array, own: Mask) -> Iterator[tuple[float, Mask]]:
    own = own & np.isfinite(theta)
    if not np.any(own):
        return
    for angle in np.arange(0.0, theta[own].max() + ANGLE_STEP_DEG, ANGLE_STEP_DEG):
        near = own & (np.abs(theta - angle) <= ANGLE_STEP_DEG / 2.0)
        if np.any(near):
            yield float(angle), near


def _weighted(means: Array, counts: NDArray[np.int64]) -> float:
    """Mean over all values, of the means over groups and their counts; NaN without values."""
    total = int(np.sum(counts))
    return float(np.sum(means[counts > 0] * counts[counts > 0])) / total if total else np.nan


def _root(total: float, count: int) -> float:
    return float(np.sqrt(total / count)) if count else np.nan


def _root_mean(squares: Array) -> float:
    return float(np.sqrt(np.mean(squares))) if squares.size else np.nan

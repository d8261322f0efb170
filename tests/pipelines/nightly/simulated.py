"""Nights without pictures: measures drawn with the scatter that `accuracy --regime typical` has, and planted faults."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from pipelines.nightly import metrics
from pipelines.nightly.measures import SCHEMA
from pipelines.nightly.metrics import METRICS

CAMERAS = ("perspective", "stereographic", "equidistance", "equisolid", "orthogonal")
DETECTOR, SOLVER = "edge-fit", "best detected exact all"
CORNERS = 54
MEASURED = [metric.name for metric in (*metrics.CORNERS, *metrics.POSES)]  # of the detector and of our solver

# Standard deviation over the poses of a frame's value, from 400 frames.
CORNER_SCATTER_PX, CIRCLE_SCATTER_PX, LOG_LENGTH_SCATTER = 0.0007, 0.010, 0.8
NEES_SCATTER = 0.057  # half of what independent corners would have: their stated noise follows the frame's own


def night(poses, rng, fault=None, camera="equisolid"):
    """Table of measures of one night: noise that nobody has seen before, and a fault in one camera."""
    return pa.concat_tables([_camera(name, poses, rng, fault if name == camera else None) for name in CAMERAS])


def corner_bias(size_px):
    """Every corner moves along x."""

    def plant(values):
        values["corner_x"] += size_px

    return plant


def more_noise(factor):
    """Corners scatter `factor` times as much; their stated covariance knows nothing of it."""

    def plant(values):
        for name in ("corner_x", "corner_y", "corner_radial"):
            values[name] *= factor
        values["corner_log_ms"] += 2.0 * np.log(factor)
        values["corner_nees"] *= factor**2

    return plant


def circle_shift(size_px):
    """The circle's centre moves along x."""

    def plant(values):
        values["circle_x"] += size_px

    return plant


def stated_covariance(factor):
    """Covariances of points are stated `factor` times as large, and with them those of poses."""

    def plant(values):
        values["corner_nees"] /= factor
        values["pose_nees"] /= factor
        for name in MEASURED:
            if name.endswith("_normalised"):
                values[name] /= np.sqrt(factor)

    return plant


def _camera(camera, poses, rng, fault):
    values = {name: rng.normal(0.0, 1.0, poses) for name in MEASURED}
    for name in ("corner_x", "corner_y", "corner_radial"):
        values[name] *= CORNER_SCATTER_PX
    for name in ("circle_x", "circle_y"):
        values[name] *= CIRCLE_SCATTER_PX
    values["corner_log_ms"] = -10.67 + np.log(rng.chisquare(2 * CORNERS, poses) / (2 * CORNERS)) + 0.3 * _bias(poses)
    values["corner_nees"] = 1.0 + NEES_SCATTER * values["corner_nees"]
    components = np.stack([values[name] for name in MEASURED if name.endswith("_normalised")])
    values["pose_nees"] = np.mean(components**2, axis=0)
    for name in ("pose_log_t", "pose_log_R"):
        values[name] = -4.0 + LOG_LENGTH_SCATTER * values[name]
    if fault is not None:
        fault(values)
    of_points = [name for name in MEASURED if name.startswith(("corner", "circle"))]
    of_poses = [name for name in MEASURED if name not in of_points]
    both = ((DETECTOR, of_points), (SOLVER, of_poses))
    return pa.concat_tables([_rows(camera, system, values, poses, held) for system, held in both])


def _bias(poses):
    """What the poses have in common on every night: a board that is far away is seen worse."""
    return np.random.default_rng(0).normal(0.0, 1.0, poses)


def _rows(camera, system, values, poses, held):
    columns = {"regime": ["typical"] * poses, "camera_name": [camera] * poses, "system": [system] * poses}
    columns |= {"frame_id": np.arange(poses), "pose_id": np.arange(poses), "failed": np.zeros(poses, bool)}
    columns |= {name: values[name] if name in held else pa.nulls(poses, pa.float64()) for name in METRICS}
    return pa.table([columns[field.name] for field in SCHEMA], schema=SCHEMA)

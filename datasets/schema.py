"""Arrow schemas of the tables. Units are in the names, meanings in the metadata; the dictionary is made from them."""

from __future__ import annotations

from dataclasses import fields
from typing import get_type_hints

import pyarrow as pa

from eposit.calibrated_lens import MOST_COEFFICIENTS
from render.world import WorldDraw

SCHEMA_VERSION = "3"
NAN_VERSION = "2"  # had NaN for every null, and `scores` without what `SCORES_ADDED` names
READABLE = (NAN_VERSION, SCHEMA_VERSION)
SCORES_ADDED = ("failure_reason", "distance_mm", "field_deg", "tilt_deg")
MEANING = b"meaning"

FRAME_ID = "frame_id"  # in every table

_STATUS = "ok, or the reason of failure; a failed row keeps its place with nulls"


def _field(name: str, kind: pa.DataType, meaning: str) -> pa.Field:
    return pa.field(name, kind, metadata={MEANING: meaning.encode()})


def _floats(meanings: dict[str, str]) -> list[pa.Field]:
    return [_field(name, pa.float64(), meaning) for name, meaning in meanings.items()]


_TYPES = {int: pa.int64(), bool: pa.bool_(), float: pa.float64()}


def _world_fields() -> list[pa.Field]:
    """One column for each value that is drawn of a world."""
    hints = get_type_hints(WorldDraw), get_type_hints(WorldDraw, include_extras=True)
    return [
        _field(f"{WORLD_PREFIX}{field.name}", _TYPES[hints[0][field.name]], hints[1][field.name].__metadata__[0])
        for field in fields(WorldDraw)
    ]


WORLD_PREFIX = "world_"  # before the name of what is drawn of a world; null in recipes without [world]
# How the pose moves under a rolling shutter; null under a global one.
MOTION_COLUMNS = {
    "line_time_us": "time from one row's exposure to the next one's; the pose is that of row (height_px - 1) / 2",
    **{
        f"v_{axis}_mm_per_s": f"{axis} of the velocity of the object frame's origin in the camera frame"
        for axis in "xyz"
    },
    **{f"w_{axis}_rad_per_s": f"{axis} of the rotation vector per second, in the camera frame" for axis in "xyz"},
}
_POSE = _floats(
    {f"q_{axis}": f"{axis} of the unit quaternion of cam_from_obj, w >= 0" for axis in "wxyz"}
    | {f"t_{axis}_mm": f"{axis} of the object frame's origin in the camera frame" for axis in "xyz"}
)
_IMAGE = pa.struct([pa.field("bytes", pa.binary()), pa.field("path", pa.string())])
_KEY = [
    _field("frame_id", pa.int64(), "frame"),
    _field("solver", pa.string(), "solver, function or file of poses that made the estimate"),
    _field(
        "point_source",
        pa.string(),
        "image points it was given: detected (by which detector), truth, or truth with noise; image: the image alone",
    ),
    _field("assumed_camera", pa.string(), "camera it assumed: exact, nominal or paper"),
    _field("point_set", pa.string(), "object points it used: four or all"),
    _field("noise_draw", pa.int32(), "draw of the point noise; 0 where there is none"),
]

FRAMES = pa.schema(
    [
        _field("frame_id", pa.int64(), "frame, from 0"),
        _field("pose_id", pa.int64(), "pose; frames of one pose differ by camera only"),
        _field("time_s", pa.float64(), "time on the trajectory; the number of the pose where it has no time"),
        _field("camera_name", pa.string(), "camera's name in the recipe"),
        _field("lens", pa.string(), "lens law"),
        _field("image", _IMAGE, "8-bit PNG, grey or in colour"),
        *_POSE,
        *_floats(
            {
                "fx_px": "true focal length along x",
                "fy_px": "true focal length along y",
                "cx_px": "true principal point, pixel centres at integers",
                "cy_px": "true principal point, pixel centres at integers",
                **{f"k{i}": f"coefficient {i} of the lens, 0 if it has fewer" for i in range(1, 1 + MOST_COEFFICIENTS)},
                "nominal_f_px": "focal length that a user without calibration assumes",
                "tilt_deg": "angle between the board's normal and the optical axis",
            }
        ),
        *(_field(name, pa.int32(), meaning) for name, meaning in (
            ("width_px", "image width"),
            ("height_px", "image height"),
            ("region_x_px", "left edge of the rendered region"),
            ("region_y_px", "top edge of the rendered region"),
            ("region_width_px", "width of the rendered region"),
            ("region_height_px", "height of the rendered region"),
        )),
        _field("render_seed", pa.int64(), "seed of the rays of path-traced pictures; closed forms have none"),
        _field("sensor_seed", pa.int64(), "seed of the noise and of the light's direction"),
        _field("master", pa.string(), "path of the linear-light EXR within the dataset, where these are kept"),
        _field("truth", pa.string(), "path of the EXR with truth for every pixel within the dataset; null: none asked"),
        *_world_fields(),
        *_floats(MOTION_COLUMNS),
    ]
)  # fmt: skip

KEYPOINTS = pa.schema(
    [
        _field("frame_id", pa.int64(), "frame"),
        _field(
            "point_id",
            pa.int32(),
            "point, row by row: inner corners and then the raised circle, corners of tags, or discs",
        ),
        *_floats(
            {
                "x_obj_mm": "x in the object frame",
                "y_obj_mm": "y in the object frame",
                "z_obj_mm": "z in the object frame, into the board",
                "x_px": "true image of the point; null beyond the lens",
                "y_px": "true image of the point; null beyond the lens",
                "x_outline_px": "centroid of the projected outline: of a circle; a corner's is the corner",
                "y_outline_px": "centroid of the projected outline: of a circle; a corner's is the corner",
                "theta_deg": "incidence angle",
            }
        ),
        _field("in_image", pa.bool_(), "whether the point lies on the picture"),
        _field(
            "visible",
            pa.bool_(),
            "whether the point is there, lies on the picture, faces the camera and has nothing before it, by a traced "
            "ray; null by the closed form, where only the disc stands before the board",
        ),
    ]
)

# Columns that older datasets do not have. Where one holds nothing it takes no part in a table's hash, so that a dataset
# without a world has the hash it always had.
LATER_COLUMNS = frozenset({
    "truth", "visible", "ambiguous", "covariance_unreliable", "joint_factor_px", *MOTION_COLUMNS,
    *(field.name for field in _world_fields()),
})  # fmt: skip

DETECTIONS = pa.schema(
    [
        _field("frame_id", pa.int64(), "frame"),
        _field("detector", pa.string(), "what placed the corners: edge-fit, board-fit, opencv-subpix or opencv-sb"),
        _field("point_id", pa.int32(), "point, as in keypoints"),
        *_floats(
            {
                "x_px": "detected image of the point",
                "y_px": "detected image of the point",
                "var_x_px2": "stated variance of x",
                "cov_xy_px2": "stated covariance of x and y",
                "var_y_px2": "stated variance of y",
            }
        ),
        _field("status", pa.string(), _STATUS),
        _field("finder", pa.string(), "finder that saw the board; empty if none"),
        _field("blur_px", pa.float64(), "median blur of the board's edges"),
        _field(
            "joint_factor_px",
            pa.list_(pa.field("element", pa.float64())),
            "of board-fit: a matrix of 2 x k, row by row; the covariance of two points of a frame is that of one times "
            "that of the other transposed. Null: a point whose error is taken for independent of the others', or none",
        ),
    ]
)

_AMBIGUOUS = _field(
    "ambiguous",
    pa.bool_(),
    "whether another pose is nearly as likely on the same points. Null: no pose, or the solver does not tell",
)

_UNRELIABLE = _field(
    "covariance_unreliable",
    pa.bool_(),
    "whether the cost is no parabola as the covariance states it, or contradicts the points' stated errors. "
    "Null: no pose, or the solver does not tell",
)

ESTIMATES = pa.schema(
    [
        *_KEY,
        _field("status", pa.string(), _STATUS),
        _field("n_points", pa.int32(), "points that the solver was given"),
        *_POSE,
        _field("iterations", pa.int32(), "iterations of start and refinement"),
        _field("reprojection_rmse_px", pa.float64(), "root mean squared reprojection error, assumed camera"),
        _field(
            "covariance",
            pa.list_(pa.field("element", pa.float64()), 36),
            "6 x 6, row by row: rotation vector on the left in the camera frame, rad; then t, mm. Null: none stated",
        ),
        _AMBIGUOUS,
        _UNRELIABLE,
    ]
)

# Six components of a pose error in the order of a pose's covariance.
COMPONENTS = ("wx", "wy", "wz", "tx", "ty", "tz")

SCORES = pa.schema(
    [
        *_KEY,
        _field("status", pa.string(), _STATUS),
        _field(
            "failure_reason",
            pa.string(),
            "null where the status is ok; for points_missing what detection says of the points that are missing, or "
            "beyond_lens where true points have no image; hidden where fewer than four points are visible; else the "
            "status",
        ),
        *_floats(
            {
                "distance_mm": "true distance of the board's centre from the camera",
                "field_deg": "true angle of the board's centre from the optical axis",
                "tilt_deg": "true angle between the board's normal and the optical axis",
                "rotation_error_deg": "angle between estimated and true rotation",
                "rx_error_deg": "estimate minus truth about x, R = Rz Ry Rx",
                "ry_error_deg": "estimate minus truth about y",
                "rz_error_deg": "estimate minus truth about z",
                "tx_error_mm": "estimate minus truth along x",
                "ty_error_mm": "estimate minus truth along y",
                "tz_error_mm": "estimate minus truth along z",
                "t_error_relative": "length of the translation error over the true distance",
                "reprojection_rmse_px": "root mean squared reprojection error, assumed camera",
                **{
                    f"{name}_normalised": f"error of {'rotation vector' if name[0] == 'w' else 'translation'} along "
                    f"{name[1]} over its stated standard deviation"
                    for name in COMPONENTS
                },
            }
        ),
        _field(
            "gross_failure",
            pa.bool_(),
            "the paper's star: no solution, or a translation at least twice the true one; where the target is "
            "hidden: a solution",
        ),
        _AMBIGUOUS,
        _UNRELIABLE,
    ]
)

BOUNDS = pa.schema(
    [
        _field("frame_id", pa.int64(), "frame"),
        _field(
            "covariance",
            pa.list_(pa.field("element", pa.float64()), 36),
            "6 x 6, row by row, as in estimates: the least that any unbiased solver reaches on the frame's pixels with "
            "the light unknown. Null: the pixels do not determine the pose",
        ),
    ]
)

# Columns by which rows are chosen.
KEYS = (*(field.name for field in _KEY), "pose_id", "camera_name", "detector", "status")

TABLES: dict[str, pa.Schema] = {
    "frames": FRAMES,
    "keypoints": KEYPOINTS,
    "detections": DETECTIONS,
    "estimates": ESTIMATES,
    "scores": SCORES,
    "bounds": BOUNDS,
}


def meanings(schema: pa.Schema) -> dict[str, str]:
    """Column to meaning."""
    return {field.name: (field.metadata or {}).get(MEANING, b"").decode() for field in schema}


def dictionary() -> str:
    """The data dictionary as Markdown."""
    lines: list[str] = []
    for name, schema in TABLES.items():
        lines += [f"### {name}", "", "| column | type | meaning |", "|---|---|---|"]
        lines += [f"| `{column}` | {schema.field(column).type} | {text} |" for column, text in meanings(schema).items()]
        lines.append("")
    return "\n".join(lines)

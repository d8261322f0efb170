"""Problems that the solver once gave up, or answered wrong without a word."""

from __future__ import annotations

from collections import Counter

import numpy as np

import eposit
from eposit.pose import rotation_error_rad
from tests.cases.answers import Case, said_by

REACHED = 1.0 + 1e-6  # of the cost that a least-squares fit from the truth has: two iterations stop at different steps


def _camera(data):
    """The camera of a file: one that names no size has the paper's."""
    if "fx" in data:
        names = ("fx", "fy", "cx", "cy", "width", "height")
        return eposit.Camera(lens=str(data.get("lens", "perspective")), **{name: data[name].item() for name in names})
    f, c = data["f"], data["c"]
    return eposit.Camera(lens=str(data["lens"]), fx=f[0], fy=f[1], cx=c[0], cy=c[1], width=1600, height=1200)


def _degrees(R, truth):
    return np.degrees(rotation_error_rad(R, truth))


def _counts(statuses):
    return ", ".join(f"{n} `{status}`" for status, n in Counter(map(str, np.atleast_1d(statuses))).most_common())


def face_on(data):
    """Coplanar points that face the camera."""
    solution = eposit.solve(data["points_in_obj"], data["points_px"], _camera(data))
    return f"{_counts(solution.status)}; RMSE at most {np.nanmax(solution.reprojection_rmse_px):.2f} px"


def square(data):
    """Four corners of a square: two poses."""
    solution = eposit.solve(data["points_in_obj"], data["points_px"], _camera(data), sigma_px=0.5)
    others = np.sum(np.isfinite(solution.alternatives.cost))
    off = _degrees(solution.cam_from_obj.R, data["R"])
    return f"`{solution.status}`, {off:.1e} degrees off; other poses told: {others}"


def far_origin(data):
    """Object coordinates far from their origin, against the same points about their middle."""
    points, middle = data["points_in_obj"], data["points_in_obj"].mean(axis=0)
    solution, near = (eposit.solve(p, data["points_px"], _camera(data)) for p in (points, points - middle))
    off = _degrees(solution.cam_from_obj.R, near.cam_from_obj.R)
    shift = np.linalg.norm(solution.cam_from_obj.R @ middle + solution.cam_from_obj.t - near.cam_from_obj.t)
    return f"`{solution.status}`, {off:.1e} degrees and {shift:.1e} from the pose about the middle"


def solution_pose(solution):
    """R and t."""
    return solution.cam_from_obj.R, solution.cam_from_obj.t


def wrong_points(data):
    """Some points are of something else."""
    points, pixels = (data[a] if a in data else data[b] for a, b in (("points_in_obj", "X"), ("points_px", "y")))
    sigma = data["sigma_px"] if "sigma_px" in data else data["sigma"]
    solution = eposit.solve(points, pixels, _camera(data), robust=True, sigma_px=float(sigma))
    off = _degrees(solution.cam_from_obj.R, data["R"])
    return f"`{solution.status}`, {off:.2f} degrees off"


def few_distinct(data):
    """Five rows, three distinct points."""
    return f"`{eposit.solve(data['points_in_obj'], data['points_px'], _camera(data)).status}`"


def reached(data):
    """Costs against those of a fit from the truth."""
    solution = eposit.solve(data["X"], data["y"], _camera(data))
    least = data["lm_cost"] if "lm_cost" in data else data["cost_lm"]
    cost = _costs(data, solution)
    return f"{_counts(solution.status)}; cost reached in {np.sum(cost <= REACHED * least)} of {np.size(least)}"


def _costs(data, solution):
    """Sums of squared residuals, px^2."""
    R, t = solution_pose(solution)
    seen = _camera(data).project(np.einsum("...ij,nj->...ni", R, data["X"]) + t[..., None, :])
    return np.sum((seen - data["y"]) ** 2, axis=(-2, -1))


ASKED = (
    ("C08_flat_faceon_not_converged.npz", "198 problems of nine coplanar points that face the camera",
     "198 `not_converged`", "a minimum (OpenCV: 1.1 px RMSE)", face_on),
    ("C09_four_coplanar.npz", "four corners of a square marker", "`coplanar`", "two poses; exact data decide", square),
    ("C10_utm_coordinates.npz", "object coordinates of millions", "`not_converged`, or 0.5 degrees off in silence",
     "the pose of the points minus their centroid", far_origin),
    ("C11_half_outliers.npz", "50 of 100 points wrong, `robust=True`", "`ok`, RMSE 92 px", "the true pose, or a status",
     wrong_points),
    ("robust_ok_wrong_14of54.npz", "14 of 54 points wrong, `robust=True`", "`ok`, RMSE 35 px, 15 degrees off",
     "the true pose, or a status", wrong_points),
    ("C12_three_distinct_points.npz", "five rows, three distinct points", "`ok`, another exact pose",
     "a status: fewer than four points", few_distinct),
    ("notconverged_board_equisolid_6000_0.2.npz", "25 frontal boards at 6 m", "`not_converged`",
     "the cost of a fit from the truth", reached),
    ("notconverged_near4_equisolid_2000_0.2.npz", "68 near-flat problems of four points", "`not_converged`",
     "the cost of a fit from the truth", reached),
    ("wrongmin_flat0.01_4_equidistance_0.npz", "four nearly coplanar points", "`ok` at a cost of 2.11",
     "a cost of 1.46", reached),
)  # fmt: skip


def cases(folder):
    """A case for each file of problems."""

    def answer(name, ask):
        with np.load(folder / name) as data:
            return ask({key: data[key] for key in data.files})

    return [
        Case(name, what, before, said_by(lambda name=name, ask=ask: answer(name, ask)), right)
        for name, what, before, right, ask in ASKED
    ]

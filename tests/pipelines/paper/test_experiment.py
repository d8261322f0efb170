"""The paper's experiment: its recipe, OpenCV's calibration, and what is told of poses, on projected points."""

import dataclasses

import numpy as np
import pytest

from datasets.errors import UserError
from datasets.plan import plan
from datasets.recipe.model import load_recipe, parse_recipe, values
from eposit import Pose
from eposit.pose import tilt_rad
from pipelines.pages.sections import Drawing, Table
from pipelines.paper.claims import Verdict
from pipelines.paper.experiment import compare, figures, section
from pipelines.paper.experiment.pictures import HARD, Pictures, by_eposit, estimated
from pipelines.paper.experiment.times import Cost
from pipelines.statistics import Interval
from tests.datasets.trajectories.test_trajectories import BASE


@pytest.fixture(scope="module")
def recipe():
    return load_recipe("experiment")[0]


@pytest.fixture(scope="module")
def pictures(recipe):
    """Projected points with 0.02 px of noise; nothing is rendered. The 13th picture's board was not found."""
    frames, target = plan(recipe), recipe.target
    spec, rng = frames[0].camera, np.random.default_rng(0)
    camera = spec.true_camera()
    pixels = np.stack([camera.project(frame.cam_from_obj.apply(target.points)) for frame in frames])
    pixels += 0.02 * rng.standard_normal(pixels.shape)
    pixels[12] = np.nan
    truth = Pose(np.stack([f.cam_from_obj.R for f in frames]), np.stack([f.cam_from_obj.t for f in frames]))
    sigma = np.broadcast_to(0.02**2 * np.eye(2), (*pixels.shape, 2))
    status = ["0 points, board_not_found" if i == 12 else "ok" for i in range(30)]
    return Pictures(target, recipe.four_indices(), camera, spec.nominal_camera(), truth, pixels, sigma, status)


@pytest.fixture(scope="module")
def found(pictures):
    return compare(pictures)


def test_the_recipe_has_thirty_whole_boards_of_which_three_are_hard(recipe):
    frames = plan(recipe)  # which refuses cropped ones
    assert len(frames) == 30
    assert not recipe.allow_cropped
    spec = frames[0].camera
    assert spec.nominal_f == 543
    assert np.hypot(spec.cx - 799.5, spec.cy - 599.5) == pytest.approx(15, abs=0.5)
    assert [i for i, f in enumerate(frames, 1) if f.sensor != recipe.sensor] == [13]
    assert frames[12].sensor == dataclasses.replace(recipe.sensor, defocus_radius_px=5.5)
    points = np.stack([f.cam_from_obj.apply(recipe.target.points) for f in frames])
    field = np.degrees(np.arctan2(np.hypot(points[..., 0], points[..., 1]), points[..., 2])).max(axis=1)
    tilt = np.degrees([tilt_rad(f.cam_from_obj.R) for f in frames])
    assert [i for i, angle in enumerate(field, 1) if angle > 62] == [22]
    assert [i for i, angle in enumerate(tilt, 1) if angle > 46] == [11]
    assert list(HARD) == [11, 13, 22]


def test_the_calibration_finds_the_true_camera_and_poses(pictures, found):
    # 29 pictures of 54 corners with 0.02 px: OpenCV's model holds sin(theta) to 1e-4 px; ten times what is measured.
    np.testing.assert_allclose(found.camera.matrix[[0, 1], [0, 1]], [553.9, 554.4], atol=0.5)
    np.testing.assert_allclose(found.camera.matrix[:2, 2], [810.5, 588.7], atol=0.5)
    turn = found.calibration.turn_rad(pictures.cam_from_obj)
    assert np.nanmax(turn) < 0.01
    assert np.flatnonzero(np.isnan(turn)).tolist() == [12]
    # The root mean square distance is sqrt(2) deviations, less what the fitted pose takes.
    assert np.nanmedian(found.calibration.used_px) == pytest.approx(0.02 * np.sqrt(2), rel=0.1)


def test_a_picture_without_a_board_keeps_its_row(found, pictures):
    for result in found.results:
        assert len(result.status) == 30
        assert result.status[12] == "points_missing"
        assert np.all(np.isnan(result.cam_from_obj.t[12]))
    exact = dataclasses.replace(pictures, nominal=pictures.true)
    assert estimated("x", exact, by_eposit, exact.true, exact.four).status[3] == "ok"


def test_the_section_has_every_picture_and_claim(found):
    some = Interval(1.0, 0.5, 2.0)
    made = section({"points": found}, Cost(some, some, {"points": np.arange(30.0)}))
    tables = [item for item in made.items if isinstance(item, Table)]
    assert len(tables[0].rows) == 30
    assert all(len(row) == len(table.head) for table in tables for row in table.rows)
    assert [row[2] for row in tables[0].rows] == [f"{i}" for i in range(30)]  # each detection has its time
    assert [row[2] for row in tables[-1].rows] == ["0.1", "0.1", "7.6"]  # beside the paper's
    assert sum(isinstance(item, Drawing) for item in made.items) == 3
    assert len(made.claims) == 7
    assert all(claim.part == "experiment" and claim.why for claim in made.claims)


@pytest.mark.parametrize(
    ("alone_ms", "detection_ms", "verdict"),
    [(0.02, 30.0, Verdict.PARTLY), (0.02, 0.05, Verdict.HOLDS), (0.2, 30.0, Verdict.FAILS)],
)
def test_times_are_judged_as_printed_and_exchanged(found, alone_ms, detection_ms, verdict, monkeypatch):
    for name in ("poses_figure", "differences_figure", "reprojection_figure"):  # which take seconds
        monkeypatch.setattr(figures, name, lambda *_: "")
    alone = Interval(alone_ms, alone_ms, alone_ms)
    made = section({"points": found}, Cost(alone, alone, {"points": np.full(30, detection_ms)}))
    (claim,) = (one for one in made.claims if one.text.startswith("time of EPOSIT"))
    assert claim.verdict == verdict


LISTED = f"""\
{BASE}[trajectory]
kind = "listed"
"""


def test_a_listed_pose_stands_where_it_says():
    listed = parse_recipe(
        f"{LISTED}poses = [{{ centre_mm = [100, 0, 2000], angle_deg = [0, 30, 0], defocus_radius_px = 2 }}]", "x"
    )
    (frame,) = plan(listed)
    centre = frame.cam_from_obj.apply(listed.target.board_centre[None])[0]
    np.testing.assert_allclose(centre, [100, 0, 2000], atol=1e-9)  # rounding of numbers of 2000
    np.testing.assert_allclose(frame.cam_from_obj.R[:, 2], [0.5, 0, np.sqrt(0.75)], atol=1e-12)
    assert frame.sensor == dataclasses.replace(listed.sensor, defocus_radius_px=2.0)
    assert values(listed)["trajectory.poses"] == "1 poses"
    assert values(listed)["trajectory.poses.angle_deg"] == "[0.0, 30.0, 0.0]"


@pytest.mark.parametrize(
    ("poses", "sentence"),
    [
        ("", "key 'trajectory.poses' is missing"),
        ("poses = []", "trajectory poses lists 0; give 1 to"),
        ("poses = [{ centre = [0, 0, 2000] }]", "did you mean 'centre_mm'.*known keys there are centre_mm, angle_deg"),
        ("poses = [{ centre_mm = [0, 0, 'a'] }]", "centre_mm.2' is 'a'.*x, y, z of the board's centre"),
        ("poses = [{ centre_mm = [0, 0, 2000], defocus_radius_px = 30 }]", "defocus_radius_px is 30.0; it must lie in"),
    ],
)
def test_wrong_lists_of_poses_are_refused_in_words(poses, sentence):
    with pytest.raises(UserError, match=sentence):
        parse_recipe(LISTED + poses, "x")

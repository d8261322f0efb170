"""What goes beyond the paper: each section says what it measured, and its scales are right."""

import numpy as np
import pytest
from scipy.stats import chi2

from datasets.errors import UserError
from pipelines.pages.sections import Drawing, Table
from pipelines.paper.beyond import efficiency, robustness
from pipelines.paper.beyond.assumed_lens import LENSES, assumed_lens
from pipelines.paper.beyond.coverage import CHI_SQUARE_95, coverage, squared_errors
from pipelines.paper.beyond.efficiency import bound, more_points
from pipelines.paper.beyond.field import SOLVERS, WIDE, field
from pipelines.paper.beyond.field_images import field_of_images
from pipelines.paper.beyond.uniqueness import ends, random_problems, uniqueness
from pipelines.paper.claims import Verdict
from pipelines.paper.problems import (
    NORMAL_MEDIAN,
    OBJECT,
    at_field_angle,
    bounds,
    camera_with,
    helix,
    information,
    turned,
)
from tests.cameras import helix_pose


def table_of(section, title=""):
    return next(item for item in section.items if isinstance(item, Table) and title in item.title)


def value(cell):
    return float(cell.split()[0])


def test_poses_are_where_they_are_said_to_be():
    pose = at_field_angle(70.0, 50, 1)
    x, y, z = pose.t.T
    np.testing.assert_allclose(np.degrees(np.arctan2(np.hypot(x, y), z)), 70.0, rtol=1e-12)
    path = helix()
    assert len(path.t) == 361
    np.testing.assert_allclose(path.t[100], helix_pose(100.0).t, rtol=1e-12)
    np.testing.assert_allclose(path.R[100], helix_pose(100.0).R, atol=1e-12)
    away = turned(path, 40.0, 2)
    np.testing.assert_allclose(np.linalg.norm(away.t, axis=1), np.linalg.norm(path.t, axis=1), rtol=1e-12)
    assert WIDE.sees(at_field_angle(110.0, 50, 3).apply(OBJECT)).all()


def test_information_of_chosen_points_is_that_of_all_when_all_are():
    camera, path = camera_with("orthogonal"), helix(60.0)
    whole = information(camera, OBJECT, path)
    np.testing.assert_allclose(
        information(camera, OBJECT, path, right=np.ones((len(path.t), 4), bool)), whole, rtol=1e-9
    )
    less = information(camera, OBJECT, path, right=np.arange(4) * np.ones((len(path.t), 1)) < 3)
    assert np.all(bounds(less) > bounds(whole))


def test_field_stops_where_it_must():
    section = field(trials=12, angles=(0, 30, 70, 100))
    assert sum(isinstance(item, Drawing) for item in section.items) == 1
    rows = {row[0]: dict(zip(SOLVERS, map(value, row[1:]), strict=True)) for row in table_of(section, "exact").rows}
    for angle, successes in rows.items():
        assert successes["centred"] == successes["best"] == 100.0
        assert successes["eposit"] == successes["posit"] == (100.0 if float(angle) < 50 else 0.0)
    assert rows["70"]["opencv-sqpnp"] > 50.0
    assert rows["100"]["opencv-sqpnp"] == 0.0
    assert min(value(row[4]) for row in table_of(section, "noise").rows) == 100.0  # best; 12 trials within 5 bounds


def test_coverage_is_that_of_a_chi_square():
    np.testing.assert_allclose(CHI_SQUARE_95, chi2.ppf(0.95, 6), rtol=1e-12)
    estimate, truth = squared_errors("orthogonal", 20, 1500, 0.4, 2)
    # The mean of chi-square is 6; over 1500 values it scatters by sqrt(12 / 1500) = 0.09: four of those.
    assert abs(estimate.mean() - 6.0) < 0.36
    assert abs(truth.mean() - 6.0) < 0.36
    table = table_of(coverage(trials=300))
    assert len(table.rows) == 4
    # 300 trials at 95 % scatter by 1.3 %.
    assert all(90.0 < value(row[2]) <= 100.0 for row in table.rows)


def test_the_default_is_at_the_bound_and_eposit_above():
    np.testing.assert_allclose(NORMAL_MEDIAN, np.sqrt(chi2.ppf(0.5, 1)), rtol=1e-12)
    for row in table_of(bound(draws=3)).rows:
        ratios = [value(cell) for cell in row[2:]]
        # The median of 1083 values scatters by 4 %.
        assert (
            all(1.3 < ratio < 2.5 for ratio in ratios)
            if row[1] == "EPOSIT"
            else all(0.85 < ratio < 1.15 for ratio in ratios)
        )


def test_more_points_help(monkeypatch):
    monkeypatch.setattr(efficiency, "COUNTS", (4, 12))
    section = more_points(draws=1, step=3.0)
    for row in table_of(section).rows:
        eposit, default, least = map(float, row[2:5])
        assert eposit > least
        assert 0.8 < default / least < 1.2  # an RMS of 3 x 121 values scatters by 4 %
    assert section.claims[0].verdict == Verdict.HOLDS


def test_a_fixed_point_that_is_proved_single_is_the_pose():
    section = uniqueness(count=300)
    for row in table_of(section).rows:
        proved, right, wrong, lost = (value(cell) for cell in row[2:6])
        assert proved <= right
        assert right + wrong + lost == pytest.approx(100.0, abs=0.02)  # two digits are shown
    assert value(table_of(section).rows[0][2]) == 100.0
    assert value(table_of(section).rows[-1][3]) < 90.0
    assert section.claims[0].verdict == Verdict.PARTLY
    system, truth = random_problems(300, 0.6, 8)
    single, right, _, _, doubled = ends(system, truth, 9)
    assert 50 < single.sum() < 250
    assert np.all(right[single])
    assert not np.any(doubled[single])


def test_a_wrong_lens_matters_off_the_axis_only():
    section = assumed_lens(step=60.0)
    tables = [item for item in section.items if isinstance(item, Table)]
    assert len(tables) == 8
    for table in tables:
        for i in range(len(LENSES)):
            assert table.rows[i][i + 1] == "0"
    orthogonal_as_equidistance = [float(table.rows[4][3]) for table in tables[:4]]
    assert orthogonal_as_equidistance[0] < 0.2
    assert orthogonal_as_equidistance[2] > 5.0
    (claim,) = section.claims
    assert claim.verdict == Verdict.PARTLY


def test_wrong_points_are_recovered(monkeypatch):
    monkeypatch.setattr(robustness, "POINTS", {8: robustness.POINTS[8]})
    for row in table_of(robustness.robustness(trials=15)).rows:
        assert value(row[4]) == 100.0
        assert value(row[5]) == 0.0


def test_spoiled_points_are_the_ones_that_moved():
    pixels = np.random.default_rng(1).uniform(0.0, 1000.0, (40, 9, 2))
    for spoil, count in zip(robustness.SPOILS, (0, 1, 2), strict=True):
        result, right = robustness.spoiled(pixels, spoil, 2)
        np.testing.assert_array_equal(np.any(result != pixels, axis=2), ~right)
        assert set(np.sum(~right, axis=1)) == {count}


def test_pictures_of_a_dataset(tiny):
    table = table_of(field_of_images(tiny[1]))
    assert table.head[2:] == SOLVERS
    assert all(value(row[5]) > 0.0 for row in table.rows)


def test_no_dataset_is_a_sentence(tmp_path):
    with pytest.raises(UserError, match=r"\w+ .*"):
        field_of_images(tmp_path)

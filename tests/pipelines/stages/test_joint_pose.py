"""Poses from the points of a board fit, whose errors are shared."""

import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest

from datasets.rows import joint_factors_by_frame
from datasets.store.dataset import open_dataset
from eposit import solve
from eposit.pose import rotation_error_vector
from pipelines.stages.joint_pose import as_if_independent, jointly
from tests.pipelines.detection.sheets import Sheet, fitted


def test_points_without_a_common_error_keep_their_covariances():
    blocks = np.random.default_rng(0).uniform(0.5, 1.5, (6, 2))
    factor = np.zeros((6, 2, 12))
    factor.reshape(12, 12)[np.arange(12), np.arange(12)] = blocks.ravel()
    np.testing.assert_allclose(as_if_independent(factor), blocks[..., None] ** 2 * np.eye(2))


def test_points_with_one_error_count_as_one_coordinate():
    """Ten coordinates of one error: each alone has ten times its variance."""
    factor = np.full((5, 2, 1), 0.3)
    np.testing.assert_allclose(as_if_independent(factor), np.full((5, 2, 2), 10.0 * 0.09))


@pytest.mark.parametrize(
    ("chosen", "displaced"), [(range(54), 0.0), ((0, 8, 45, 31), 0.0), (range(54), 0.1)], ids=["all", "four", "print"]
)
def test_poses_of_a_board_fit_err_as_their_covariances_say(chosen, displaced):
    sheet, chosen, squares = Sheet(displaced=displaced), list(chosen), []
    designed = sheet.points(np.random.default_rng(0))[0][chosen]
    for found in (fitted(sheet=sheet, seed=seed) for seed in range(2)):
        for error, factor, pose in zip(found.errors, found.factors, found.poses, strict=True):
            pixels = (found.camera.project(pose.apply(designed)) + error[chosen])[None]
            first = solve(designed, pixels, found.camera, sigma_px=as_if_independent(factor[chosen]))
            solution = jointly(first, designed, pixels, found.camera, factor[chosen])
            assert solution.status[0] == "ok"
            turn = rotation_error_vector(solution.cam_from_obj.R, pose.R[None])[0]
            miss = np.concatenate((turn, solution.cam_from_obj.t[0] - pose.t))
            squares.append(miss @ np.linalg.solve(solution.covariance[0], miss) / 6.0)
    # 96 numbers tell an RMS to 0.07, and a board's scatter is known to 0.07: measured 0.9 to 1.0. With the covariances
    # of the points alone, all of them would say 2.5.
    assert 0.75 < np.sqrt(np.mean(squares)) < 1.3


def test_points_with_too_few_errors_of_their_own_give_no_pose():
    """Along three directions nothing tells six numbers."""
    found = fitted()
    designed = Sheet().points(np.random.default_rng(0))[0]
    pixels = (found.camera.project(found.poses[0].apply(designed)))[None]
    solution = solve(designed, pixels, found.camera)
    lost = jointly(solution, designed, pixels, found.camera, found.factors[0][:, :, :3])
    assert lost.status[0] == "not_converged"
    assert np.isnan(lost.cam_from_obj.t).all()


def test_a_dataset_keeps_the_joint_covariance_and_poses_use_it(tiny, tmp_path, cli):
    root = tmp_path / "dataset"
    shutil.copytree(tiny[1], root)
    for arguments in (("detect",), ("estimate",), ("estimate", "--use", "four", "--solver", "eposit")):
        assert cli(arguments[0], root, "-q", "--detector", "board-fit", *arguments[1:]).code == 0
    assert cli("score", root, "-q").code == 0
    dataset = open_dataset(root)
    path = root / "detections" / "board-fit-00000-of-00002.parquet"
    rows = dataset.read_shard(path)
    (factor,) = joint_factors_by_frame(rows, dataset.recipe.target).values()
    stated = np.stack([np.array(rows[name]) for name in ("var_x_px2", "cov_xy_px2", "var_y_px2")], axis=1)
    blocks = factor @ factor.transpose(0, 2, 1)
    np.testing.assert_array_equal(blocks.reshape(-1, 4)[:, [0, 1, 3]], stated)
    plain = dataset.read_shard(root / "detections" / "detections-00000-of-00002.parquet")
    assert joint_factors_by_frame(plain, dataset.recipe.target) == {}

    (ours, theirs) = (
        pq.read_table(root / "estimates" / f"best-{points}-exact-all-00000-of-00002.parquet").to_pylist()[0]
        for points in ("detected-board-fit", "detected")
    )
    assert ours["status"] == theirs["status"] == "ok"
    # The smooth map holds all that the corners tell of the pose, so that it is told as well, not better: with the
    # covariances of the points alone, 0.3 of these deviations would be stated.
    deviations = [np.sqrt(np.diag(np.reshape(row["covariance"], (6, 6)))) for row in (ours, theirs)]
    assert deviations[0] == pytest.approx(deviations[1], rel=0.3)
    moved = np.array([ours[f"t_{axis}_mm"] - theirs[f"t_{axis}_mm"] for axis in "xyz"])
    assert np.all(np.abs(moved) < deviations[1][3:])

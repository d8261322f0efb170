"""Wrong use of a user's systems in a night: one sentence, before anything is rendered."""

import pytest

from datasets.errors import UserError
from pipelines.nightly.systems import asked
from tests.pipelines.nightly.test_systems import QUICK

WRONG_CODE = {
    "missing": ("nosuch:f", "importing nosuch failed with ModuleNotFoundError"),
    "unknown": ("wrong:nosuch", "wrong has no 'nosuch'"),
    "arguments": ("wrong:two", "it must take (points_in_obj, points_px, camera"),
    "ends": ("ends:f", "importing it ended its process"),
    "hangs": ("hangs:f", "did not end within 8 s"),
}


@pytest.mark.full
@pytest.mark.parametrize("name", WRONG_CODE)
def test_a_function_that_cannot_be_called_is_one_sentence(name, tmp_path, cli, monkeypatch):
    """Exit code 2, before anything is rendered."""
    (tmp_path / "wrong.py").write_text("def two(a, b): pass\n")
    (tmp_path / "ends.py").write_text("import os; os._exit(0)\n")
    (tmp_path / "hangs.py").write_text("import time; time.sleep(600)\n")
    monkeypatch.chdir(tmp_path)
    given, told = WRONG_CODE[name]
    limit = ("--time-limit", 8) if name == "hangs" else ()
    done = cli(*QUICK, "--solver", given, "--history", "nights", *limit)
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert done.err.startswith(f"error: --solver {given}")
    assert told in done.err
    assert not (tmp_path / "nights" / "pictures").exists()


WRONG_POSES = {
    "no name": ((["poses.csv"], [], "table"), "--poses and --name go together"),
    "one name for two": ((["poses.csv", "poses.csv"], ["a", "a"], "table"), "give each file of poses a name"),
    "missing": ((["nosuch.csv"], ["theirs"], "table"), "cannot read nosuch.csv"),
    "unknown frame": (
        (["poses.csv"], ["theirs"], "table"),
        "frame_id 99, which pinned-typical has not; its frames are 0 to 5",
    ),
    "name": ((["poses.csv"], ["a b"], "table"), "name 'a b' is not usable"),
    "form": ((["poses.csv"], ["theirs"], "rosbag"), "unknown --pose-format 'rosbag'; give one of table, kitti"),
    "table as tum": ((["poses.csv"], ["theirs"], "tum"), "poses.csv"),
    "form of nothing": (([], [], "tum"), "--pose-format goes with --poses"),
}


@pytest.mark.parametrize("name", WRONG_POSES)
def test_wrong_poses_are_told_before_anything_is_rendered(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "poses.csv").write_text("frame_id,q_w,q_x,q_y,q_z,tx,ty,tz\n99,1,0,0,0,0,0,2000\n")
    poses, told = WRONG_POSES[name]
    with pytest.raises(UserError, match=r".*") as refused:
        asked("nightly-smoke", ["typical"], ([], []), poses, 60.0)
    assert told in str(refused.value)


def test_one_file_of_poses_for_two_regimes_is_refused():
    with pytest.raises(UserError, match=r"write \{regime\} in its name, as poses-\{regime\}.csv, or give one --regime"):
        asked("nightly-smoke", ["typical", "harsh"], ([], []), (["poses.csv"], ["theirs"], "table"), 60.0)


@pytest.mark.parametrize("given", ["0", "-1", "nan", "inf"])
def test_a_time_limit_is_a_time(given, tmp_path, cli):
    done = cli(*QUICK, "--time-limit", given, "--history", tmp_path)
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "give seconds above 0" in done.err

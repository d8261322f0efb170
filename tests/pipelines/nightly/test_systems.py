"""A user's solver, estimator and poses in whole nights: every exit code, by what causes it.

All share one history of six small frames. The user's code lies in a folder of its own, which is the current one.
"""

import datetime
import shutil
import time

import pytest

from datasets.store.dataset import open_dataset
from pipelines.nightly import baselines
from pipelines.nightly.acceptance import accept_baseline
from pipelines.nightly.accepted import Waiver
from pipelines.nightly.baselines import FILE_NAME
from pipelines.nightly.gates import speed
from pipelines.nightly.history import History
from pipelines.nightly.other_code import CHOOSE_CODE, ROOT, Code, OtherCodeError
from tests.conftest import command

RUN = ("nightly", "run", "nightly-smoke", "--regime", "typical", "--seed", 7, "--quiet")
QUICK = (*RUN, "--without", "fresh", "--without", "speed")
POSES = ("--poses", "poses.csv", "--name", "theirs")
OWN = ("--solver", "mine:solve", "--estimator", "mine:estimate", *POSES)
SLICES = {f"typical/orthogonal/{name} exact all" for name in ("mine:solve detected", "mine:estimate image")}
THEIRS = "typical/orthogonal/theirs image exact all"

MINE = """\
import helper

def solve(points_in_obj, points_px, camera):
    return helper.solve(points_in_obj, points_px, camera)

def estimate(image, camera, target):
    import cv2
    found, corners = cv2.findChessboardCorners(image, target.inner)
    return helper.solve(target.corners, corners.reshape(-1, 2), camera) if found else None
"""
HELPER = """\
import cv2
import numpy as np

def solve(points_in_obj, points_px, camera):
    rays = camera.bearing(points_px)
    _, vector, t = cv2.solvePnP(points_in_obj, rays[:, :2] / rays[:, 2:], np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP)
    return cv2.Rodrigues(vector)[0], t.ravel()
"""
WORSE = HELPER.replace("t.ravel()", "t.ravel() + [0, 0, 20]")  # mm; the baseline's own errors are some tenths
STATED = HELPER.replace(
    "return cv2", "from types import SimpleNamespace as S; return S(status='ok', t=t.ravel(), R=cv2"
)
STATED = STATED.replace("[0], t.ravel()", "[0], covariance=np.eye(6))")
FAULTS = {
    "raises": "    raise RuntimeError('no luck today')",
    "exits": "    raise SystemExit(0)",
    "ends": "    import os; os._exit(0)",
    "hangs": "    import time; time.sleep(600)",
    "strange": "    return 5",
}


def _poses(root, path, frames=range(6), shift_mm=0.0):
    """A file of poses that are off by a tenth of a millimetre, and by a shift."""
    rows = open_dataset(root / "pictures" / "pinned-typical").read("frames").to_pylist()
    names = ("q_w", "q_x", "q_y", "q_z", "t_x_mm", "t_y_mm", "t_z_mm")
    lines = [",".join(("frame_id", *names))]
    for row in rows:
        if row["frame_id"] in frames:
            row["t_x_mm"] += 0.1 * (-1) ** row["frame_id"] + shift_mm
            lines.append(",".join(str(row[name]) for name in ("frame_id", *names)))
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """The user's folder; in it a history whose baseline has the user's systems."""
    folder = tmp_path_factory.mktemp("own")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        (folder / "mine.py").write_text(MINE)
        (folder / "helper.py").write_text(HELPER)
        assert command(*QUICK, "--history", "nights") == 3  # makes the pictures, and has no baseline yet
        _poses(folder / "nights", folder / "poses.csv")
        assert command(*QUICK, *OWN, "--history", "nights") == 3
        accept_baseline(folder / "nights", "latest", "the first", "somebody")
    return folder


@pytest.fixture
def night(own, cli, monkeypatch):
    """Run a night in the user's folder, which is afterwards what it was; what it printed, and its row."""
    monkeypatch.chdir(own)
    known = {name: (own / name).read_bytes() for name in ("mine.py", "helper.py", "poses.csv")}
    known[f"nights/{FILE_NAME}"] = (own / "nights" / FILE_NAME).read_bytes()

    def run(*words):
        done = cli(*words, "--history", "nights")
        row = History(own / "nights").run("latest")
        assert done.code == row["exit"], done.err
        return done, row

    yield run
    for name, content in known.items():
        (own / name).write_bytes(content)


def _state(row, gate):
    (found,) = [item for item in row["gates"] if item["gate"] == gate]
    return found["state"], found["sentence"]


def _worse(own, row):
    found = History(own / "nights").findings([row["run_id"]]).to_pylist()
    return {(item["suite"], item["slice"]) for item in found if item["verdict"] == "worse"}


@pytest.mark.full
def test_the_same_systems_are_fine_on_both_suites_and_timed(night, own, monkeypatch):
    monkeypatch.setattr(speed, "MOST_TURNS", speed.TURNS)  # on a busy machine more of them would tell no more
    _, row = night(*RUN, *OWN)
    assert row["exit"] in (0, 1)  # the time of a busy machine is not what is tested
    assert _state(row, "accuracy") == ("passed", "every number of every frame is the same as the baseline's")
    state, told = _state(row, "fresh")
    assert state == "passed"
    assert told.endswith("; without theirs, whose poses are of the pinned pictures")
    compared = History(own / "nights").findings([row["run_id"]]).to_pylist()
    assert {item["slice"] for item in compared if item["suite"] == "pinned"} >= SLICES | {THEIRS}
    fresh = {item["slice"] for item in compared if item["suite"] == "fresh"}
    assert fresh >= SLICES
    assert THEIRS not in fresh
    assert {item["metric"] for item in compared if item["slice"] in SLICES} == {
        "pose_log_t", "pose_log_R", *(f"{kind}{axis}_error" for kind in "tr" for axis in "xyz"),
    }  # fmt: skip
    assert [item["stage"] for item in row["speed"]] == ["detect", "estimate", "mine:solve", "mine:estimate"]


@pytest.mark.full
def test_a_helper_that_got_worse_is_found_on_both_suites(night, own):
    """Exit code 1. The baseline's side reads the copy of the helper, and not the one in the current folder."""
    (own / "helper.py").write_text(WORSE)
    _, row = night(*RUN, *OWN, "--without", "speed")
    assert row["exit"] == 1
    assert _worse(own, row) == {(suite, name) for suite in ("pinned", "fresh", "confirming") for name in SLICES}
    assert "mine:" in row["sentence"]


@pytest.mark.full
def test_poses_that_got_worse_are_found_and_those_that_lack_frames_fail(night, own):
    """Exit code 1."""
    _poses(own / "nights", own / "poses.csv", shift_mm=5.0)
    _, row = night(*QUICK, *POSES)
    assert (row["exit"], _worse(own, row)) == (1, {("pinned", THEIRS)})
    _poses(own / "nights", own / "poses.csv", frames=(0, 1, 2, 3))
    _, row = night(*QUICK, *POSES)
    assert _state(row, "ran")[1].endswith("poses.csv has no pose for 2 of 6 frames, which count as failures")
    assert _state(row, "failures") == ("failed", f"2 new failures: frame 4 in {THEIRS}, frame 5 in {THEIRS}")
    assert row["exit"] == 1


@pytest.mark.full
def test_a_failure_of_a_users_system_can_be_waived(night, own):
    _poses(own / "nights", own / "poses.csv", frames=(0, 1, 2, 3, 4))
    until = datetime.date.today()
    waiver = Waiver(gate="failures", slice=THEIRS, frame=5, reason="known", by="x", run="r", until=until)
    baselines.accept(own / "nights" / FILE_NAME, waiver)
    _, row = night(*QUICK, *POSES)
    assert (row["exit"], _state(row, "failures")[0]) == (0, "waived")


@pytest.mark.full
@pytest.mark.parametrize("fault", FAULTS)
def test_a_function_that_breaks(night, own, fault):
    """One that raises, exits or ends its process has failures, code 1; one that hangs or is not understood, code 4."""
    (own / "mine.py").write_text(MINE.replace("camera):\n", f"camera):\n{FAULTS[fault]}\n", 1))
    started = time.monotonic()
    limit = ("--time-limit", 30) if fault == "hangs" else ()
    done, row = night(*QUICK, *OWN, *limit)
    assert time.monotonic() - started < 500.0  # it was not waited for
    if fault == "ends":
        assert row["exit"] == 1
        assert _state(row, "failures")[1].startswith("6 new failures")
        return
    if fault in ("raises", "exits"):
        assert row["exit"] == 1
        assert _state(row, "failures")[1].startswith("6 new failures: frame 0 in typical/orthogonal/mine:solve")
        assert "6 of 6 rows have the status solver_error; frame 0: " in done.err
        return
    assert row["exit"] == 4
    told = {"hangs": "did not end within 30 s", "strange": "int"}
    assert row["sentence"].startswith("ran: could not run: --solver mine:solve")
    assert told[fault] in row["sentence"]


@pytest.mark.full
def test_a_function_that_begins_to_state_covariances_loses_nothing(night, own):
    (own / "helper.py").write_text(STATED)
    _, row = night(*QUICK, *OWN)
    assert row["exit"] == 0
    assert _state(row, "failures") == ("passed", "no frame fails that did not fail before")


@pytest.mark.full
def test_a_system_that_is_new_or_left_out_is_told(night):
    """Nothing of it is judged, and the night does not hide that."""
    _, row = night(*QUICK, *OWN[:4], "--solver", "mine:solve", "--solver", "helper:solve")
    state, told = _state(row, "accuracy")
    assert (row["exit"], state) == (0, "warned")
    assert told == (
        f"not read tonight, though the baseline has them: {THEIRS}; "
        "not judged until a run with them is accepted: typical/orthogonal/helper:solve detected exact all"
    )


@pytest.mark.full
def test_other_pictures_give_no_verdict(night, own):
    """Exit code 3."""
    (own / "nights" / FILE_NAME).write_text((own / "nights" / FILE_NAME).read_text().replace('pinned_data = "', '"#"'))
    baseline = (own / "nights" / FILE_NAME).read_text().splitlines()
    text = [f'pinned_data = "{"0" * 64}"' if line.startswith('"#"') else line for line in baseline]
    (own / "nights" / FILE_NAME).write_text("\n".join(text))
    _, row = night(*QUICK, *OWN)
    assert (row["exit"], _state(row, "data")[0]) == (3, "failed")


@pytest.mark.full
def test_a_baseline_whose_copy_of_a_function_is_gone_or_does_not_import(night, own):
    """Exit code 4 in the gates that need it; the pinned pictures are judged."""
    (entry,) = baselines.load(own / "nights" / FILE_NAME).baselines
    copy = entry.systems["mine:solve"]
    aside = copy.with_name("aside")
    shutil.copytree(copy, aside)
    try:
        (copy / "helper.py").write_text("raise ImportError('no such library')\n")
        _, row = night(*RUN, *OWN, "--without", "speed")
        assert (row["exit"], _state(row, "accuracy")[0], _state(row, "fresh")[0]) == (4, "passed", "failed")
        assert "no such library" in _state(row, "fresh")[1]
        shutil.rmtree(copy)
        (own / "helper.py").write_text(WORSE)  # another copy than the baseline's
        _, row = night(*RUN, *OWN, "--without", "speed")
        assert (row["exit"], _state(row, "accuracy")[0]) == (4, "failed")
        assert "where no folder is; restore it" in _state(row, "fresh")[1]
    finally:
        shutil.rmtree(copy, ignore_errors=True)
        aside.rename(copy)


def test_the_frozen_copy_answers_and_not_the_current_folder(tmp_path, monkeypatch):
    """Also for what it imports, after the function has been looked up as `estimate` does."""
    for place in ("copy", "today"):
        (tmp_path / place).mkdir()
        (tmp_path / place / "mine.py").write_text(MINE)
        (tmp_path / place / "helper.py").write_text("solve = None\n")
    monkeypatch.chdir(tmp_path / "today")
    program = "from pipelines.adapters.user import load_function\nload_function('mine:solve', '--solver')\n"
    program += "print(*(sys.modules[name].__file__ for name in ('mine', 'helper')))\n"
    code = Code(ROOT, user=("mine", tmp_path / "copy"))
    said = code.run_program(CHOOSE_CODE + program, what="where").stdout.split()
    assert said == [str(tmp_path / "copy" / name) for name in ("mine.py", "helper.py")]
    (tmp_path / "copy" / "mine.py").unlink()
    with pytest.raises(OtherCodeError, match="mine is None, not in"):
        code.run_program(CHOOSE_CODE, what="where")

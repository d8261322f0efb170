"""Pictures that take too long: tried twice, told, and tried again by the next run with all that follows from them."""

import shutil

import pytest

from datasets.store.dataset import open_dataset
from pipelines.detection import detect_points
from pipelines.stages import detect

LATE = 1  # a frame of the tiny dataset


@pytest.fixture
def copy(tiny, tmp_path):
    """Folder of a copy of the tiny dataset without detections and what is made from them."""
    root = tmp_path / "dataset"
    shutil.copytree(tiny[1], root, ignore=shutil.ignore_patterns("detections", "estimates", "scores", "masters"))
    return root


@pytest.fixture
def slow(monkeypatch):
    """Make the detection of a picture of the tiny dataset too slow the first so many times; the tries are counted."""

    def made(root, times):
        dataset = open_dataset(root)
        frames = dataset.read("frames", ["image"])["image"].to_pylist()
        late = detect.decode_image(frames[LATE], root, LATE)
        tries = []

        def detected(image, target, detector, seconds):
            if image.shape == late.shape and (image == late).all():
                tries.append(seconds)
                if len(tries) <= times:
                    return detect_points(image, target, detector, -1.0)
            return detect_points(image, target, detector, seconds)

        monkeypatch.setattr(detect, "detect_points", detected)
        return tries

    return made


def statuses(root):
    rows = open_dataset(root).read("detections", ["frame_id", "status"]).to_pylist()
    return {row["status"] for row in rows if row["frame_id"] == LATE}


def rows(root, table):
    return open_dataset(root).read(table)


def test_a_picture_that_was_slow_once_is_tried_again(tiny, copy, slow, cli):
    tries = slow(copy, 1)
    outcome = cli("detect", copy, "--quiet", "--detect-seconds", 40)
    assert (outcome.code, tries) == (0, [40.0, 40.0])
    assert "too_late" not in outcome.err
    assert rows(copy, "detections") == rows(tiny[1], "detections")


def test_a_picture_that_is_always_slow_is_told_and_tried_by_the_next_run_with_all_that_is_made_from_it(copy, slow, cli):
    slow(copy, 2)
    outcome = cli("detect", copy, "--quiet")
    assert outcome.code == 0
    assert f"detect: frame {LATE} took more than 2 s of processor time twice" in outcome.err
    assert statuses(copy) == {"too_late"}
    failed = estimated(copy, cli)
    assert failed[LATE] == "points_missing"
    assert cli("detect", copy, "--quiet").code == 0
    assert "too_late" not in statuses(copy)
    assert len(open_dataset(copy).shards("scores")) == 1  # of the two: that of the late frame is removed
    again = estimated(copy, cli)
    assert again[LATE] == "ok"
    assert {frame: again[frame] for frame in failed if frame != LATE} == {
        frame: failed[frame] for frame in failed if frame != LATE
    }


def estimated(root, cli):
    """frame_id to the status of its pose by the default setting, once estimated and scored."""
    assert cli("estimate", root, "--quiet").code == 0
    assert cli("score", root, "--quiet").code == 0
    found = rows(root, "scores").to_pylist()
    return {row["frame_id"]: row["status"] for row in found}


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "1e9"])
def test_a_limit_that_is_none_is_refused(seconds, copy, cli):
    outcome = cli("detect", copy, "--detect-seconds", seconds)
    assert outcome.code == 2
    assert "give seconds of processor time above 0, at most 86400, as 2" in " ".join(outcome.err.split())

"""A user's whole system, from image to pose: what it is given, which rows it makes, how they reach the report."""

import re
import shutil
from pathlib import Path

import pytest

from datasets.store.dataset import open_dataset
from pipelines.report.page import REPORT
from tests.own import image_rows, own_module
from tests.wrong_input import assert_one_sentence, files

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "own_estimator.py"


@pytest.fixture
def own(tmp_path, monkeypatch):
    return lambda text: own_module(tmp_path, monkeypatch, text)


def toy():
    """The example that the guide offers for copying."""
    return EXAMPLE.read_text()


@pytest.mark.usefixtures("no_figures")
def test_the_example_estimator_comes_out_in_tables_and_report(own, root, cli):
    name = f"{own(toy())}:estimate"
    assert cli("estimate", root, "--estimator", name, "-q").code == 0
    assert cli("score", root, "-q").code == 0
    assert cli("report", root).code == 0
    made, scores = image_rows(root, "estimates", name), image_rows(root, "scores", name)
    assert [row["frame_id"] for row in made] == [0, 1]
    for row, score in zip(made, scores, strict=True):
        key = {
            "solver": name,
            "point_source": "image",
            "assumed_camera": "exact",
            "point_set": "all",
            "noise_draw": 0,
            "status": "ok",
        }
        assert key.items() <= row.items()
        assert key.items() <= score.items()
        assert row["n_points"] == 0
        assert row["reprojection_rmse_px"] is None
        # OpenCV's own corners are some 0.1 px off, on a board of 200 px: 0.5 mrad, 0.03 degrees; five times that.
        assert score["rotation_error_deg"] < 0.2
        assert score["t_error_relative"] < 2e-3
    text = (root / REPORT).read_text()
    for setting in (f"{name} image exact all", "best detected exact all"):
        assert f'<th scope="row" data-value="{setting}">' in text
        assert f"<summary>{setting}</summary>" in text
    before = files(root)
    assert cli("estimate", root, "--estimator", name, "-q").code == 0
    assert {path: data for path, (_, data) in before.items()} == {path: data for path, (_, data) in files(root).items()}


@pytest.mark.full
def test_two_workers_make_the_same_rows(own, root, cli, content):
    name, found = f"{own(toy())}:estimate", []
    for words in (("--workers", 1), ("--overwrite", "--workers", 2)):
        assert cli("estimate", root, "--estimator", name, "-q", *words).code == 0
        assert cli("score", root, "-q").code == 0
        found.append(content(root))
    assert found[0] == found[1]


SEES = """
    import numpy as np

    def estimate(image, camera, target):
        assert image.dtype == np.uint8 and image.shape == (camera.height, camera.width)
        image[:] = 0
        return np.eye(3), (camera.fx, camera.cx, target.square_mm)
"""


@pytest.mark.parametrize(
    ("camera", "fx", "cx"), [("exact", 344.7, 201.9), ("nominal", 338.0, 200.0), ("paper", 338.0, 201.9)]
)
def test_what_a_system_is_given(camera, fx, cx, own, root, cli):
    name = f"{own(SEES)}:estimate"
    assert cli("estimate", root, "--estimator", name, "--camera", camera, "-q").code == 0
    for row in image_rows(root, "estimates", name, camera):
        assert (row["assumed_camera"], row["status"]) == (camera, "ok")
        assert (row["t_x_mm"], row["t_y_mm"], row["t_z_mm"]) == (fx, cx, 100.0)


FAILS = """
    from dataclasses import dataclass

    @dataclass
    class Found:
        R: object = None
        t: object = None
        status: str = "too dark"

    count = 0

    def estimate(image, camera, target):
        global count
        count += 1
        if count == 1:
            return Found()
        raise KeyError("board")

    def never(image, camera, target):
        return None
"""


def test_failures_of_a_system_are_rows(own, root, cli):
    name = own(FAILS)
    done = cli("estimate", root, "--estimator", f"{name}:estimate", "-q")
    assert done.code == 0
    assert done.err == (
        f"estimate {name}@estimate-image-exact-all: 1 of 2 rows have the status solver_error; frame 1: "
        "KeyError: 'board'\n"
    )
    assert cli("estimate", root, "--estimator", f"{name}:never", "-q").err == ""
    assert cli("score", root, "-q").code == 0
    assert cli("report", root).code == 0
    assert [row["status"] for row in image_rows(root, "scores", f"{name}:estimate")] == ["too dark", "solver_error"]
    never = image_rows(root, "scores", f"{name}:never")
    assert [(row["status"], row["gross_failure"]) for row in never] == [("no_solution", True)] * 2
    text = (root / REPORT).read_text()
    row = text[text.index(f'data-value="{name}:never image exact all"') :]
    assert re.match(r'[^\n]*<td class="number" data-value="0.0"><span class="attention">0 of 2</span>', row)
    assert f"{name}:never image exact all failed in 2 of 2 estimates: 2 no_solution." in text


@pytest.mark.usefixtures("no_figures")
def test_a_system_needs_no_detections(own, root, cli):
    for table in ("detections", "estimates", "scores"):
        shutil.rmtree(root / table)
    name = f"{own(toy())}:estimate"
    assert cli("estimate", root, "--estimator", name, "-q").code == 0
    assert cli("score", root, "-q").code == 0
    assert cli("report", root).code == 0
    assert f'<th scope="row" data-value="{name} image exact all">' in (root / REPORT).read_text()
    assert open_dataset(root).read("scores").num_rows == 2


WRONG = {
    "no such module": (("--estimator", "nowhere_at_all:f"), "--estimator nowhere_at_all:f: importing nowhere_at_all"),
    "no such function": (("--estimator", "{}:f"), "has no 'f'"),
    "no function named": (("--estimator", "{}"), "is not a function's name; give it as package.module:function"),
    "a solver's name": (("--estimator", "best"), "--estimator 'best' is not a function's name"),
    "empty": (("--estimator", ""), "--estimator '' is not a function's name"),
    "wrong arguments": (("--estimator", "{}:two"), "is (image, camera); it must take (image, camera, target)"),
    "wrong result": (("--estimator", "{}:vector"), "gave R of shape (3,); it must be of shape (3, 3), such as cv2."),
    "unknown camera": (("--estimator", "{}:none", "--camera", "wide"), "unknown camera 'wide'; choose one of exact"),
    "with a solver": (("--estimator", "{}:none", "--solver", "best"), "leave out --solver"),
    "with points": (("--estimator", "{}:none", "--points", "truth"), "the options that choose points"),
    "with draws": (("--estimator", "{}:none", "--draws", "7"), "the options that choose points"),
}
FUNCTIONS = """
    def two(image, camera): return None
    def vector(image, camera, target): return [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]
    def none(image, camera, target): return None
"""


@pytest.mark.parametrize("case", WRONG)
def test_a_system_that_is_not_usable_gives_one_sentence(case, own, root, cli):
    words, sentence = WRONG[case]
    name, before = own(FUNCTIONS), files(root)
    done = cli("estimate", root, *(word.format(name) for word in words), "-q")
    assert_one_sentence(done.code, done.err, sentence)
    assert files(root) == before


def test_a_picture_that_cannot_be_read_names_the_shard(own, root, cli):
    from tests.wrong_input import put_image

    put_image(root, b"not a PNG")
    done = cli("estimate", root, "--estimator", f"{own(FUNCTIONS)}:none", "-q")
    assert_one_sentence(done.code, done.err, "the image is not an 8-bit PNG, grey or in colour")

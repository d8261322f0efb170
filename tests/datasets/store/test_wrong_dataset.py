"""A wrong place, a damaged file or a stage out of order: one sentence, exit code 2, and nothing is lost."""

from __future__ import annotations

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.wrong_input import alone, assert_one_sentence, assert_refused, doctor, first, garbage, on_dataset, put_image


def damaged(file, change, *words, without=()):
    """A command on a dataset whose first file of a folder was changed: bytes to bytes, or to None for deleted."""

    def arrange(place):
        root = place.dataset(without)
        path = first(root, file)
        data = change(path.read_bytes())
        path.unlink() if data is None else path.write_bytes(data)
        return words[0], root, *words[1:]

    return arrange


def half(data):
    return data[: len(data) // 2]


def gone(data):
    return None


def not_a_png(*words):
    def arrange(place):
        root = place.dataset(without=["detections"] if words[0] == "detect" else [])
        put_image(root, b"not a PNG")
        return words[0], root, *words[1:]

    return arrange


def other_recipe(place):
    return "generate", "smoke", "--out", place.dataset()


def recipe_of_dataset(data):
    """A dataset whose own recipe is damaged."""

    def arrange(place):
        root = place.dataset()
        (root / "recipe.toml").write_bytes(data)
        return "generate", place.recipe(), "--out", root

    return arrange


def out_is_a_file(place):
    place.new().write_text("mine")
    return "generate", place.recipe(), "--out", place.new()


def out_under_a_file(place):
    place.new().write_text("mine")
    return "generate", place.recipe(), "--out", place.new() / "dataset"


def out_not_empty(place):
    place.new().mkdir()
    (place.new() / "notes.txt").write_text("mine")
    return "generate", place.recipe(), "--out", place.new()


def before_generate(place):
    root = place.new()
    root.mkdir()
    (root / "recipe.toml").write_text(place.text)
    return "detect", root


def _mixed(root):
    """A dataset with a sound shard that carries another recipe's hash."""
    doctor(first(root, "frames"), lambda rows: rows, recipe="0" * 64)
    return root


PLACES = {
    "another recipe's folder": (other_recipe, "holds a dataset of another recipe"),
    "dataset with a recipe in no encoding": (recipe_of_dataset(b"\xff\xfe\x00"), "it is not UTF-8 text"),
    "dataset with a damaged recipe": (recipe_of_dataset(b"name"), "is not valid TOML"),
    "out is a file": (out_is_a_file, "is a file; give a folder to --out"),
    "out under a file": (out_under_a_file, "Not a directory"),
    "out not empty": (out_not_empty, "is not empty and holds no dataset"),
    "no dataset": (lambda place: ("detect", place.folder), "holds no dataset (recipe.toml is missing)"),
    "dataset is a file": (lambda place: ("verify", place.recipe()), "holds no dataset"),
    "masters from nowhere": (
        lambda place: ("generate", place.recipe(), "--out", place.new(), "--reuse", place.folder / "no"),
        "holds no dataset (recipe.toml is missing)",
    ),
    "masters from here": (
        lambda place: ("generate", place.recipe(), "--out", (root := place.dataset()), "--reuse", root),
        "is the dataset that is to be made; give the folder of another one",
    ),
    "regime on the command line": (
        lambda place: ("run", place.recipe(), "--out", place.new(), "--regime", "best"),
        "sensor regime is 'best'; choose one of clean, typical, paper, harsh",
    ),
}


FILES = {
    "truncated frames": (
        damaged("frames", half, "detect", without=["detections"]),
        "is damaged: it cannot be read; `repair ",
    ),
    "truncated frames, verify": (damaged("frames", half, "verify"), "is damaged: it cannot be read"),
    "garbage keypoints": (damaged("keypoints", garbage, "report"), "is damaged: it cannot be read; `repair "),
    "garbage detections": (
        damaged("detections", garbage, "estimate", "--solver", "posit"),
        "is damaged: it cannot be read; `repair ",
    ),
    "truncated estimates": (damaged("estimates", half, "score"), "is damaged: it cannot be read; `repair "),
    "empty scores": (damaged("scores", lambda data: b"", "report"), "is damaged: it cannot be read; `repair "),
    "scores damaged under another stage": (
        damaged("scores", garbage, "estimate", "--solver", "posit"),
        "is damaged: it cannot be read; `repair ",
    ),
    "shard of another dataset": (
        lambda place: ("detect", _mixed(place.dataset(without=["detections"]))),
        "belongs to another recipe; `repair ",
    ),
    "truncated master": (damaged("masters", half, "verify"), "is damaged: it cannot be read; `repair "),
    "garbage master": (damaged("masters", garbage, "verify"), "is damaged: it cannot be read; `repair "),
    "missing master": (damaged("masters", gone, "verify"), "is missing; run the generate stage"),
    "image is no PNG": (not_a_png("detect"), "the image is not an 8-bit PNG, grey or in colour"),
    "image is no PNG, verify": (not_a_png("verify"), "the image is not an 8-bit PNG, grey or in colour"),
}


ORDER = {
    "detect before generate": (before_generate, "is missing; run the generate stage first"),
    "estimate before detect": (
        on_dataset("estimate", "--solver", "posit", without=["detections"]),
        "is missing; run the detect stage first",
    ),
    "score before estimate": (on_dataset("score", without=["estimates"]), "run the estimate stage first"),
    "report before score": (on_dataset("report", without=["scores"]), "run the score stage first"),
    "score without a shard of frames": (
        damaged("frames", gone, "score", without=["scores"]),
        "is missing; run the generate stage first",
    ),
    "report without a shard of detections": (
        damaged("detections", gone, "report"),
        "is missing; run the detect stage first",
    ),
    "detector without a shard of detections": (
        damaged("detections", gone, "estimate", "--solver", "posit"),
        "detections-00000-of-00002.parquet is missing; run the detect stage",
    ),
    "another detector before generate": (
        lambda place: (*before_generate(place), "--detector", "opencv-sb"),
        "is missing; run the generate stage first",
    ),
}

CASES = PLACES | FILES | ORDER
ALONE = (
    "out is a file",
    *(pytest.param(name, marks=pytest.mark.full) for name in ("truncated master", "score before estimate")),
)


@pytest.mark.parametrize("name", CASES)
def test_a_wrong_dataset_gives_one_sentence_and_loses_nothing(name, place, cli):
    assert_refused(CASES[name], place, cli)


@pytest.mark.parametrize("name", ALONE)
def test_a_wrong_dataset_to_a_process_of_its_own(name, place):
    arrange, words = CASES[name]
    done = alone(*arrange(place))
    assert_one_sentence(done.returncode, done.stderr, words)


@pytest.mark.parametrize(
    "image",
    [np.full((300, 400), 90, np.uint8), np.random.default_rng(0).integers(0, 256, (300, 400), dtype=np.uint8)],
    ids=["grey", "noise"],
)
def test_a_picture_without_the_board_is_a_status_not_an_error(image, place, cli):
    root = place.dataset(without=["detections", "estimates", "scores"])
    put_image(root, cv2.imencode(".png", image)[1].tobytes())
    assert cli("detect", root).code == 0
    assert cli("estimate", root).code == 0
    found = pq.read_table(first(root, "detections"))
    assert set(found["status"].to_pylist()) == {"board_not_found"}
    assert found["x_px"].null_count == found.num_rows
    assert pq.read_table(first(root, "estimates"))["status"].to_pylist() == ["points_missing"]

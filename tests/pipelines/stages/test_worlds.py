"""Datasets in worlds: the same bits however they are made, what is recorded, and a user's own scene."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

from datasets.plan import plan
from datasets.recipe.model import parse_recipe
from datasets.store.dataset import open_dataset
from datasets.store.images import decode_pixels
from datasets.store.linear_images import linear_key, linear_path, read_linear
from pipelines.stages import generate
from render.pathtraced.picture import prepared
from tests.conftest import command
from tests.wrong_input import assert_one_sentence, files, first

SMALL = {
    "width = 400": "width = 160",
    "height = 300": "height = 120",
    "fx = 344.7": "fx = 137.9",
    "fy = 345.3": "fy = 138.1",
    "cx = 201.9": "cx = 80.5",
    "cy = 150.6": "cy = 60.1",
}
WORLD = """
[world]
method = "path"
surround = "room"
draw = "pose"
clutter = [3, 3]
occluders = [1, 1]
exposure_range = [0.9, 1.1]
path_samples = 4
background_samples = 1

[outputs]
colour = true
aovs = ["range", "normal", "object_id"]
"""
SCENE = """\
<scene version="3.0.0">
    <integrator type="nothing"/>
    <shape type="rectangle"><transform name="to_world"><scale value="4"/><translate z="-1"/></transform></shape>
    <emitter type="constant"/>
</scene>
"""
MESH_OUTSIDE = '<string name="filename" value="../secret.obj"/>'


def small(text):
    for old, new in SMALL.items():
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.fixture(scope="module")
def made(tiny, tmp_path_factory):
    """A recipe with a world and the folder of its pictures, which no test may change."""
    folder = tmp_path_factory.mktemp("world")
    recipe = folder / "recipe.toml"
    recipe.write_text(small(tiny[0]) + WORLD)
    assert command("generate", recipe, "--out", folder / "dataset", "--workers", 1, "-q") == 0
    return recipe, folder / "dataset"


@pytest.mark.full
def test_two_workers_resumed_or_without_masters_give_the_same_content(made, tmp_path, cli, content):
    recipe, root = made
    expected = content(root)
    assert cli("generate", recipe, "--out", tmp_path / "two", "--workers", 2, "-q").code == 0
    assert content(tmp_path / "two") == expected
    again = tmp_path / "again"
    shutil.copytree(root, again)
    first(again, "frames").unlink()
    first(again, "masters").unlink()
    first(again, "truth").unlink()
    assert cli("generate", recipe, "--out", again, "-q", "--workers", 1).code == 0
    assert content(again) == expected
    one, other = (files(folder / "truth").values() for folder in (root, again))
    assert [data for _, data in one] == [data for _, data in other]


@pytest.mark.full
def test_linear_light_is_developed_again_without_rays(made, tmp_path, cli, monkeypatch):
    recipe, root = made

    def refuse(*_, **__):
        raise AssertionError("rendered again")

    monkeypatch.setattr(generate, "render_world", refuse)
    out = tmp_path / "typical"
    done = cli("generate", recipe, "--out", out, "--regime", "typical", "--reuse", root, "--workers", 1)
    assert "linear images: 2 of 2 taken" in done.out
    assert done.code == 0
    typical, clean = (decode_pixels(row_of(folder)["image"]["bytes"]) for folder in (out, root))
    assert typical.shape == clean.shape == (120, 160, 3)
    assert np.any(typical != clean)


def row_of(root, table="frames"):
    return open_dataset(root).read_shard(first(root, table)).to_pylist()[0]


def test_every_draw_is_recorded_and_differs_by_pose(made):
    recipe = parse_recipe(made[0].read_text(), "recipe")
    rows = open_dataset(made[1]).read("frames").to_pylist()
    for row, frame in zip(rows, plan(recipe), strict=True):
        drawn = frame.world
        assert row["world_layout_seed"] == drawn.layout_seed
        assert row["world_clutter"] == 3
        assert row["world_exposure"] == drawn.exposure
        assert frame.sensor.exposure == recipe.sensor.exposure * drawn.exposure
    assert rows[0]["world_layout_seed"] != rows[1]["world_layout_seed"]


def test_what_is_linear_in_colour_and_true_for_each_pixel(made):
    import OpenEXR

    recipe, root = parse_recipe(made[0].read_text(), "recipe"), made[1]
    frame = plan(recipe)[0]
    linear = read_linear(root / linear_path(frame.frame_id), linear_key(recipe, frame))
    assert linear.background.shape == (120, 160, 3)
    assert linear.radiance.shape[:2] == (linear.region.height, linear.region.width)
    with OpenEXR.File(str(root / row_of(root)["truth"]), separate_channels=True) as file:
        channels, objects = file.channels(), json.loads(file.header()["objects"])
        assert set(channels) == {"range.Z", "normal.X", "normal.Y", "normal.Z", "object_id"}
        assert channels["object_id"].pixels.dtype == np.uint32
        shown = {objects[number - 1] for number in np.unique(channels["object_id"].pixels)}
        assert {"board", "wall_back"} <= shown
    keypoints = open_dataset(root).read("keypoints")
    assert 0 < sum(keypoints["visible"].to_pylist()) < len(keypoints)  # something stands before some


@pytest.mark.full
def test_detection_reads_the_grey_of_colour(made, tmp_path, cli):
    root = tmp_path / "dataset"
    shutil.copytree(made[1], root)
    assert cli("detect", root, "-q").code == 0
    assert cli("verify", root).code == 0
    assert len(open_dataset(root).read("detections")) == 110


def test_the_closed_form_has_nulls(tiny):
    dataset = open_dataset(tiny[1])
    assert dataset.read("keypoints")["visible"].null_count == 110
    assert dataset.read("frames")["world_layout_seed"].null_count == 2


@pytest.mark.full
@pytest.mark.usefixtures("no_report")
def test_a_target_that_is_not_there_is_no_failure(made, tmp_path, cli):
    recipe = tmp_path / "absent.toml"
    recipe.write_text(made[0].read_text().replace("occluders = [1, 1]", "absent_share = 1.0"))
    assert cli("run", recipe, "--out", tmp_path / "absent", "-q", "--workers", 1).code == 0
    dataset = open_dataset(tmp_path / "absent")
    assert not any(dataset.read("keypoints")["visible"].to_pylist())
    for row in dataset.read("scores").to_pylist():
        if row["point_source"] == "detected":
            assert (row["status"], row["failure_reason"], row["gross_failure"]) == ("points_missing", "hidden", False)


@pytest.fixture
def scene(tiny, tmp_path):
    """A function from a scene's text to a recipe beside it that shows it."""
    (tmp_path / "secret.obj").write_text("v 0 0 0")

    def write(text=SCENE, name="scene.xml"):
        folder = tmp_path / "mine"
        folder.mkdir(exist_ok=True)
        if text is not None:
            (folder / name).write_text(text)
        world = (
            f'[world]\nmethod = "path"\nsurround = "scene"\nfile = "{name}"\npath_samples = 1\nbackground_samples = 1\n'
        )
        recipe = folder / "recipe.toml"
        recipe.write_text(small(tiny[0]) + world)
        return recipe

    return write


def test_a_users_scene_and_what_a_dataset_keeps_of_it(scene, tmp_path, cli, content):
    recipe, root = scene(), tmp_path / "dataset"
    assert cli("generate", recipe, "--out", root, "-q", "--workers", 1).code == 0
    kept = (root / "recipe.toml").read_text()
    assert f'file = "{recipe.parent / "scene.xml"}"' in kept
    assert "file_sha256" in kept
    before = content(root)
    (recipe.parent / "scene.xml").unlink()  # later stages do not need it
    assert content(root) == before
    assert cli("detect", root, "-q").code == 0
    scene(SCENE.replace('value="4"', 'value="5"'))
    first(root, "frames").unlink()
    first(root, "masters").unlink()
    prepared.cache_clear()
    done = cli("generate", str(root / "recipe.toml"), "--out", root, "--workers", 1)
    assert_one_sentence(done.code, done.err, "is not the one that world file_sha256 states")


WRONG_SCENES = {
    "not XML": (SCENE[:-9], "is not XML"),
    "missing": (None, "cannot be read"),
    "unknown plugin": (SCENE.replace("rectangle", "rectangel"), "rectangel"),
    "unknown value": (SCENE.replace('<scale value="4"/>', '<scale value="four"/>'), "four"),
    "without light": (SCENE.replace('<emitter type="constant"/>', ""), "has no light"),
    "out of its folder": (SCENE.replace('rectangle">', f'obj">{MESH_OUTSIDE}'), "lies outside its folder"),
}


@pytest.mark.parametrize("name", WRONG_SCENES)
def test_a_wrong_scene_gives_one_sentence(name, scene, tmp_path, cli):
    text, words = WRONG_SCENES[name]
    done = cli("generate", scene(text), "--out", tmp_path / "dataset", "--workers", 1, "-q")
    assert_one_sentence(done.code, done.err, words)


def test_a_camera_outside_the_room_is_refused_with_the_remedy(tiny, tmp_path, cli):
    recipe = tmp_path / "recipe.toml"
    recipe.write_text(small(tiny[0]) + '[world]\nmethod = "path"\nsurround = "room"\nroom_mm = [9000, 5000, 2000]\n')
    done = cli("generate", recipe, "--out", tmp_path / "dataset")
    assert_one_sentence(done.code, done.err, "increase world.room_mm")

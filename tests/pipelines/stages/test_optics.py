"""Datasets of a rolling shutter: what is recorded, the same bits, and detection against truth."""

from __future__ import annotations

import numpy as np
import pytest

from datasets.plan import plan
from datasets.recipe.model import parse_recipe
from datasets.store.dataset import open_dataset
from datasets.store.linear_images import linear_key
from datasets.store.nulls import with_nans
from render.motion import image_points
from render.optics import Optics
from tests.conftest import command

HAND = 'kind = "scatter"\ncount = 2\nspeed_mm_per_s = 700\nturn_deg_per_s = 40\ndepth_range_mm = [1700, 1900]'
ROLLING = "\n[optics]\nline_time_us = 60\n"


@pytest.fixture(scope="module")
def made(tiny, tmp_path_factory):
    """A recipe with a rolling shutter and the folder of its dataset, which no test may change."""
    folder = tmp_path_factory.mktemp("rolling")
    recipe = folder / "recipe.toml"
    recipe.write_text(tiny[0].replace("stop = 90\nstep = 90", HAND) + ROLLING)
    for stage in ("generate", "detect"):
        words = (recipe, "--out", folder / "dataset") if stage == "generate" else (folder / "dataset",)
        assert command(stage, *words, "--workers", 1, "-q") == 0
    return parse_recipe(recipe.read_text(), "recipe"), folder / "dataset"


def test_the_table_says_how_the_pose_moves_from_row_to_row(made, tiny):
    recipe, root = made
    for row, frame in zip(open_dataset(root).read("frames").to_pylist(), plan(recipe), strict=True):
        assert row["line_time_us"] == pytest.approx(60.0, abs=1e-9)
        assert [row[f"v_{axis}_mm_per_s"] for axis in "xyz"] == frame.rate.velocity_mm_per_s.tolist()
        assert [row[f"w_{axis}_rad_per_s"] for axis in "xyz"] == frame.rate.turn_rad_per_s.tolist()
        assert [row[f"t_{axis}_mm"] for axis in "xyz"] == frame.cam_from_obj.t.tolist()
    still = open_dataset(tiny[1]).read("frames")
    assert still["line_time_us"].null_count == still["v_x_mm_per_s"].null_count == len(still)


def test_detection_finds_the_points_where_the_table_has_them(made):
    recipe, root = made
    truth, found = (open_dataset(root).read(name) for name in ("keypoints", "detections"))
    frames, count = plan(recipe), len(recipe.target.points)
    expected = np.concatenate(
        [image_points(f.camera.true_camera(), f.cam_from_obj, recipe.target.points) for f in frames]
    )
    at, seen = (np.column_stack([with_nans(table[name]) for name in ("x_px", "y_px")]) for table in (truth, found))
    np.testing.assert_array_equal(at, expected)
    corners = np.arange(len(at)) % count < count - 1
    error = (seen - at)[corners]
    # Rounding to 8 bits leaves 0.005 px; the pose of the middle row is off by 0.3 px.
    assert np.sqrt(np.mean(error**2)) < 0.015
    middle = np.concatenate(
        [f.camera.true_camera().project(f.cam_from_obj.apply(recipe.target.points)) for f in frames]
    )
    assert np.sqrt(np.mean((seen - middle)[corners] ** 2)) > 0.15


def test_optics_decide_content_and_light_only_where_they_are_asked_for(made, tiny):
    recipe, _ = made
    still = recipe.model_copy(update={"optics": Optics()})
    assert recipe.digest() != still.digest()
    assert parse_recipe(tiny[0] + "\n[optics]\n", "a").digest() == parse_recipe(tiny[0], "b").digest()
    keys = {linear_key(which, plan(which)[0]) for which in (recipe, still)}
    assert len(keys) == 2
    faster = parse_recipe(tiny[0].replace("stop = 90\nstep = 90", HAND.replace("= 700", "= 800")) + ROLLING, "c")
    np.testing.assert_array_equal(plan(faster)[0].cam_from_obj.t, plan(recipe)[0].cam_from_obj.t)
    assert linear_key(faster, plan(faster)[0]) not in keys


@pytest.mark.full
def test_a_rolling_picture_has_the_same_bits_by_two_workers(made, tiny, tmp_path, content):
    recipe, root = tmp_path / "recipe.toml", made[1]
    recipe.write_text(tiny[0].replace("stop = 90\nstep = 90", HAND) + ROLLING)
    assert command("run", recipe, "--out", tmp_path / "two", "--workers", 2, "-q") == 0
    frames = [open_dataset(folder).read("frames") for folder in (root, tmp_path / "two")]
    assert frames[0].equals(frames[1])

"""Datasets of hybrid pictures: one bake, the same content by any number of workers and when resumed."""

from __future__ import annotations

import pytest

from datasets.store.baked_light import FILE, FOLDER

RECIPE = """
name = "tiny"
seed = 2
shard_frames = 1
allow_cropped = true
cameras = [{ name = "a", lens = "equisolid", fx = 110.0, fy = 110.2, cx = 158.3, cy = 121.9, width = 320, height = 240}]
four = [[0, 0], [2, 0], [0, 2], "circle"]
[target]
columns = 6
rows = 5
[trajectory]
stop = 20
step = 20
depth_mm = 700.0
[world]
method = "hybrid"
surround = "room"
surface = "rough_plastic"
bake_samples = 8
background_samples = 1
layer_samples = 2
[outputs]
colour = true
"""


@pytest.mark.full
@pytest.mark.usefixtures("no_report")
def test_workers_and_resuming_change_no_bit(tmp_path, cli, content):
    recipe, one, two = tmp_path / "tiny.toml", tmp_path / "one", tmp_path / "two"
    recipe.write_text(RECIPE)
    assert cli("run", recipe, "--out", one, "-q").code == 0
    assert cli("run", recipe, "--out", two, "-q", "--workers", 2).code == 0
    before = content(one)
    assert content(two) == before
    light = one / FOLDER / FILE
    assert light.read_bytes() == (two / FOLDER / FILE).read_bytes()
    light.unlink()  # baked again, to the same bits
    for path in (*(one / "frames").iterdir(), *(one / "masters").iterdir()):
        path.unlink()
    assert cli("generate", recipe, "--out", one, "-q").code == 0
    assert content(one) == before

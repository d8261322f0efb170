"""The baked light of a dataset: kept once, read back to the bit, baked again when it is another or damaged."""

import numpy as np
import pytest

from datasets.plan import plan
from datasets.recipe.model import parse_recipe
from datasets.store import baked_light as store
from render.hybrid.bake import BakedLight

RECIPE = """
name = "t"
cameras = [{ name = "a", lens = "equisolid", fx = 60.0, fy = 60.0, cx = 79.5, cy = 59.5, width = 160, height = 120 }]
[trajectory]
stop = 0
[world]
method = "hybrid"
surround = "room"
"""


@pytest.fixture
def baked(monkeypatch):
    """Every light that was baked, in place of the real ones."""
    made = []

    def bake(*_):
        rng = np.random.default_rng(len(made))
        made.append(BakedLight(*(rng.random(size).astype(np.float32) for size in ((6, 8, 3), (6, 8), (3,)))))
        return made[-1]

    monkeypatch.setattr(store, "baked_light", bake)
    return made


def light_of(root, text=RECIPE):
    store._light_of.cache_clear()  # as in a new process
    recipe = parse_recipe(text, "test")
    return store.light_of(root, recipe, plan(recipe)[0])


def test_light_is_baked_once_and_read_back_to_the_bit(tmp_path, baked):
    first, second = light_of(tmp_path), light_of(tmp_path)
    assert len(baked) == 1
    for name in ("board", "edges", "disc"):
        np.testing.assert_array_equal(getattr(second, name), getattr(first, name))


def test_light_of_something_else_or_damaged_is_baked_again(tmp_path, baked, capfd):
    light_of(tmp_path)
    light_of(tmp_path, RECIPE + "bake_samples = 64\n")
    assert len(baked) == 2
    path = tmp_path / store.FOLDER / store.FILE
    path.write_bytes(path.read_bytes()[:300])
    light_of(tmp_path, RECIPE + "bake_samples = 64\n")
    assert len(baked) == 3
    assert capfd.readouterr() == ("", "")


def test_how_pictures_are_taken_does_not_change_the_light(tmp_path, baked):
    light_of(tmp_path)
    light_of(tmp_path, RECIPE + "layer_samples = 16\nbackground_samples = 2\n")
    assert len(baked) == 1

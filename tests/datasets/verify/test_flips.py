"""A flipped bit is found by `verify`, or changes nothing that is read; no reader hands on a damaged value."""

from __future__ import annotations

import random

import numpy as np
import pytest

from datasets.errors import UserError
from datasets.plan import plan
from datasets.store.dataset import open_dataset
from datasets.store.linear_images import LinearImageError, linear_key, read_linear
from datasets.verify import shard_problem, verify
from tests.tables import OF_A_RUN
from tests.wrong_input import first

FEW, SOME, MANY = 24, 40, 1500
SMALL_FILES = ("recipe.toml", "manifest.json")


@pytest.fixture
def flipping():
    """Flip a bit of a file, chosen by a number; every file has its bytes again afterwards."""
    whole = {}

    def flip(path, number):
        data = bytearray(whole.setdefault(path, path.read_bytes()))
        place = random.Random(f"{path.name} {number}").randrange(8 * len(data))
        data[place // 8] ^= 1 << place % 8
        path.write_bytes(data)

    yield flip
    for path, data in whole.items():
        path.write_bytes(data)


def counts(few):
    """How often a test flips: in the tier of every commit, in the full one and in the slow one."""
    return [few, pytest.param(SOME, marks=pytest.mark.full), pytest.param(MANY, marks=pytest.mark.slow)]


@pytest.mark.parametrize("table", OF_A_RUN)
@pytest.mark.parametrize("count", counts(FEW))
def test_in_a_table(table, count, root, flipping):
    dataset = open_dataset(root)
    path = first(root, table)
    whole = dataset.read_shard(path)
    found = 0
    for number in range(count):
        flipping(path, number)
        problem = shard_problem(dataset, path)
        found += problem is not None
        try:
            rows = dataset.read_shard(path)
        except UserError:
            assert problem is not None
            continue
        assert rows.equals(whole)
    assert found > 0.6 * count  # .8 and more in 40; the rest lies in what Parquet keeps for itself: statistics, offsets


@pytest.mark.parametrize("table", OF_A_RUN)
@pytest.mark.parametrize("count", counts(FEW))
def test_in_a_table_of_which_some_columns_are_read(table, count, root, flipping):
    """Who reads some columns checks these: what is handed on is right, though others may be damaged."""
    dataset = open_dataset(root)
    path = first(root, table)
    columns = ["frame_id", *OF_A_RUN[table].names[-2:]]
    whole = dataset.read_shard(path, columns)
    for number in range(count):
        flipping(path, number)
        try:
            rows = dataset.read_shard(path, columns)
        except UserError:
            continue
        assert rows.equals(whole)


@pytest.mark.parametrize("count", counts(FEW))
def test_in_a_linear_image(count, root, flipping):
    dataset, path = open_dataset(root), first(root, "masters")
    key = linear_key(dataset.recipe, plan(dataset.recipe)[0])
    whole = read_linear(path, key)
    found = 0
    for number in range(count):
        flipping(path, number)
        try:
            read = read_linear(path, key)
        except LinearImageError:
            found += 1
            continue
        np.testing.assert_array_equal(read.radiance, whole.radiance)
        assert (read.region, read.background) == (whole.region, whole.background)
    assert found > 0.9 * count  # the rest lies in a header's values that nobody reads


@pytest.mark.parametrize("name", SMALL_FILES)
@pytest.mark.parametrize("count", counts(3))
def test_in_recipe_and_manifest(name, count, root, flipping):
    """A flip in the manifest that is not found lies in what it tells of the environment, or in white space."""
    content, problems = verify(open_dataset(root))
    assert problems == []
    for number in range(min(count, SOME)):
        flipping(root / name, number)
        try:
            dataset = open_dataset(root)
        except UserError:
            continue  # not TOML or no recipe any more
        again, problems = verify(dataset)
        assert problems or (name == "manifest.json" and again == content)

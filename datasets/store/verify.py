"""`verify`: is every shard there, readable, of this recipe, and as its own hash says?"""

from __future__ import annotations

from pathlib import Path

from datasets.errors import UserError
from datasets.plan import plan, shard_count
from datasets.schema import TABLES
from datasets.store.dataset import Dataset
from datasets.store.digest import table_digest
from datasets.store.linear_images import LinearImageError, are_kept, masters, read_linear
from datasets.store.manifest import Entry, content_of, shard_entry
from datasets.store.pixel_truth import truth_path
from datasets.store.refusals import stage_of
from datasets.store.shard_file import DIGEST_KEY


def verify(dataset: Dataset) -> tuple[str, list[str]]:
    """The dataset's content hash, and what is wrong with it as sentences (none if it is sound)."""
    problems: list[str] = []
    sound: list[Entry] = []
    for table in TABLES:
        for path in dataset.shards(table):
            problem = _shard_problem(dataset, path)
            if problem:
                problems.append(problem)
            else:
                sound.append(shard_entry(dataset.root, path))
    problems += _missing(dataset) + _masters(dataset) + _truth(dataset)
    return content_of(dataset.recipe.digest(), sound), problems


def _shard_problem(dataset: Dataset, path: Path) -> str | None:
    try:
        rows = dataset.stored_rows(path)
        digest = table_digest(rows)
    except UserError as error:
        return str(error)
    except ValueError as error:
        return f"{path}: {error}; delete it and run the {stage_of(path)} stage again"
    stated = (rows.schema.metadata or {}).get(DIGEST_KEY, b"").decode()
    return None if digest == stated else f"{path}: rows do not match the hash in its footer; delete it and run again"


def _missing(dataset: Dataset) -> list[str]:
    count = shard_count(dataset.recipe)
    return [
        f"{path} is missing; run the generate stage to make it"
        for table in ("frames", "keypoints")
        for path in (dataset.shard_path(table, index, count) for index in range(count))
        if not path.is_file()
    ]


def _truth(dataset: Dataset) -> list[str]:
    if not dataset.recipe.outputs.aovs:
        return []
    paths = (dataset.root / truth_path(frame) for frame in plan(dataset.recipe))
    return [f"{path} is missing; run the generate stage to make it" for path in paths if not path.is_file()]


def _masters(dataset: Dataset) -> list[str]:
    problems: list[str] = []
    if not are_kept(dataset.root):
        return problems
    for path, key in masters(dataset.root, dataset.recipe):
        try:
            read_linear(path, key)
        except LinearImageError as error:
            problems.append(str(error))
    return problems

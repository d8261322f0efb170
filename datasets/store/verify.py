"""`verify`: is every shard there, readable, of this recipe, and as its own hash says?"""

from __future__ import annotations

import hashlib
from pathlib import Path

import pyarrow.parquet as pq

from datasets.errors import UserError
from datasets.plan import shard_count
from datasets.schema import TABLES
from datasets.store.dataset import DIGEST_KEY, Dataset
from datasets.store.digest import table_digest
from datasets.store.linear_images import LinearImageError, masters, read_linear
from datasets.store.refusals import stage_of


def verify(dataset: Dataset) -> tuple[str, list[str]]:
    """The dataset's content hash, and what is wrong with it as sentences (none if it is sound)."""
    problems: list[str] = []
    total = hashlib.sha256(dataset.recipe.digest().encode())
    for table in TABLES:
        for path in dataset.shards(table):
            problem = _shard_problem(dataset, path)
            if problem:
                problems.append(problem)
                continue
            content = (pq.read_metadata(path).metadata or {})[DIGEST_KEY]
            total.update(f"{path.relative_to(dataset.root)}:".encode() + content)
    problems += _missing(dataset) + _masters(dataset)
    return total.hexdigest(), problems


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


def _masters(dataset: Dataset) -> list[str]:
    problems: list[str] = []
    for path, key in masters(dataset.root, dataset.recipe):
        try:
            read_linear(path, key)
        except LinearImageError as error:
            problems.append(str(error))
    return problems

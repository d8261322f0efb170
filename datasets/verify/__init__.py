"""`verify`: is every file there that the plan and the manifest name, is it of this recipe, and as it was written?"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa

from datasets.errors import UserError
from datasets.plan import shard_count
from datasets.schema import TABLES
from datasets.store.dataset import Dataset
from datasets.store.digest import table_digest
from datasets.store.keys import fault_of_keys
from datasets.store.manifest import Entry, content_of, shard_entry
from datasets.store.planned_rows import fault_of_images, fault_of_truth
from datasets.store.refusals import SHARD_NAME, ForeignShardError
from datasets.store.shard_file import DIGEST_KEY
from datasets.store.values import fault_of_values
from datasets.verify.images import image_problems
from datasets.verify.manifest import manifest_problems, recipe_problem
from datasets.verify.problems import Kind, Problem, damaged_file, missing_file, unplanned_file

OF_THE_PLAN = ("frames", "keypoints")  # tables that every dataset has whole


def verify(dataset: Dataset) -> tuple[str, list[Problem]]:
    """The dataset's content hash, and what is wrong with it, none if it is sound.

    Every value is read and compared with its hash, whatever `dataset.check` says. Of another recipe than the manifest's
    nothing else is told, as every file would be wrong.
    """
    wrong_recipe = recipe_problem(dataset)
    if wrong_recipe:
        return "", [wrong_recipe]
    problems: list[Problem] = []
    sound: list[Entry] = []
    for table in TABLES:
        for path in dataset.shards(table):
            problem = shard_problem(dataset, path)
            if problem:
                problems.append(problem)
            else:
                sound.append(shard_entry(dataset.root, path))
    problems += [*_missing(dataset), *_unplanned(dataset), *image_problems(dataset)]
    known = {problem.path for problem in problems}
    problems += [problem for problem in manifest_problems(dataset, sound) if problem.path not in known]
    return content_of(dataset.recipe.digest(), sound), problems


def shard_problem(dataset: Dataset, path: Path) -> Problem | None:
    """What is wrong with a shard that is there; None if nothing."""
    try:
        rows = Dataset(dataset.root, dataset.recipe).stored_rows(path)
    except UserError as error:
        return Problem(path, Kind.FOREIGN if isinstance(error, ForeignShardError) else Kind.DAMAGED, str(error))
    fault = _fault_of_rows(dataset, path, rows) or _fault_of_content(rows) or _fault_of_table(dataset, path, rows)
    return damaged_file(path, dataset.root, fault) if fault else None


def _fault_of_content(rows: pa.Table) -> str | None:
    """What is wrong with the values, images decoded, by the hash that the dataset's own is made of."""
    try:
        digest = table_digest(rows)
    except (ValueError, TypeError) as error:
        return str(error)
    stated = (rows.schema.metadata or {}).get(DIGEST_KEY, b"").decode("utf-8", "replace")
    return None if digest == stated else "its rows do not match the hash in its footer"


def _fault_of_rows(dataset: Dataset, path: Path, rows: pa.Table) -> str | None:
    return fault_of_keys(dataset.recipe, path, rows) or fault_of_values(path.parent.name, rows)


def _fault_of_table(dataset: Dataset, path: Path, rows: pa.Table) -> str | None:
    table, index = path.parent.name, dataset.index_of(path)
    fault = fault_of_truth(dataset.recipe, table, index, rows)
    return fault or (fault_of_images(dataset.recipe, index, rows) if table == "frames" else None)


def _missing(dataset: Dataset) -> Iterator[Problem]:
    """Shards of the plan, and those of kinds of detections, estimates and scores that have some."""
    count = shard_count(dataset.recipe)
    for table in TABLES:
        there = {match[1] for path in dataset.shards(table) if (match := SHARD_NAME.fullmatch(path.name))}
        for variant in sorted(there | ({table} if table in OF_THE_PLAN else set())):
            for index in range(count):
                path = dataset.shard_path(table, index, count, variant)
                if not path.is_file():
                    yield missing_file(path)


def _unplanned(dataset: Dataset) -> Iterator[Problem]:
    """Parquet files beside the shards: programs that read `TABLE/*.parquet` would take them for rows."""
    for table in TABLES:
        for path in sorted((dataset.root / table).glob("[!.]*.parquet")):
            if not SHARD_NAME.fullmatch(path.name):
                yield unplanned_file(path, dataset.root)

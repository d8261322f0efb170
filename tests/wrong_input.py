"""What the tests of wrong input share: where a case lays out its files, and what an error must look like."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pytest

from datasets.store.dataset import open_dataset
from datasets.store.known_shards import KNOWN_FILE
from datasets.store.shard_file import DIGEST_KEY, PLACE_KEY, RECIPE_KEY, VERSION_KEY, read_rows, write_rows


@dataclass(frozen=True)
class Place:
    """Where a case lays out its files."""

    folder: Path
    text: str
    source: Path
    patch: pytest.MonkeyPatch

    def recipe(self, text=None, name="recipe.toml"):
        path = self.folder / name
        path.write_bytes((self.text if text is None else text).encode())
        return path

    def dataset(self, without=()):
        root = self.folder / "dataset"
        shutil.copytree(self.source, root)
        for name in without:
            shutil.rmtree(root / name)
        if without:
            open_dataset(root).write_manifest()
        return root

    def new(self):
        return self.folder / "new"


def estimate(*words):
    return lambda place: ("estimate", place.dataset(), *words)


def on_dataset(name, *words, without=()):
    """A command on a dataset in which some tables are not there yet."""
    return lambda place: (name, place.dataset(without), *words)


def first(root, table):
    return min((root / table).iterdir())


def garbage(data):
    return bytes(range(256)) * 20


def put_image(root, data):
    """Give the first frame other image bytes, as if they had been written so, but for the hash of decoded content."""

    def put(rows):
        changed = rows.to_pylist()
        changed[0]["image"]["bytes"] = data
        return pa.Table.from_pylist(changed, schema=rows.schema)

    doctor(first(root, "frames"), put)


def doctor(path, change, **footer):
    """Change the rows of a shard, table to table, and values of its footer, with digests that fit."""
    rows = read_rows(path)
    kept = (RECIPE_KEY, VERSION_KEY, DIGEST_KEY, PLACE_KEY)
    told = {key.decode(): rows.schema.metadata[key].decode() for key in kept} | footer
    write_rows(path, path.parent.name, change(rows.replace_schema_metadata(None)), told)


def files(folder):
    """Path to content and time of every file under a folder."""
    found = (path for path in folder.rglob("*") if path.is_file())
    return {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in found}


def left_behind(root):
    """Hidden files under a dataset's folder: temporary ones, locks; not what it keeps of its footers."""
    return [path for path in root.rglob(".*") if path.name != KNOWN_FILE]


def assert_one_sentence(code, err, words):
    assert code == 2
    assert err.startswith("error: ")
    assert err.endswith("\n")
    assert err.count("\n") == 1
    assert words in err


def assert_refused(case, place, cli):
    """A case, (how its files and command are laid out, words of the sentence), is refused and no file changes."""
    arrange, words = case
    arguments = arrange(place)
    before = files(place.folder)
    outcome = cli(*arguments)
    assert_one_sentence(outcome.code, outcome.err, words)
    assert before.items() <= files(place.folder).items()


def alone(*words, **variables):
    """A command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "pipelines", *map(str, words)],
        cwd=Path(__file__).parents[1],
        env=os.environ | variables,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )

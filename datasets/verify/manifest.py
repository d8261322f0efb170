"""The manifest held against the recipe and the shards that are there: what it lists must be, and be the same."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from datasets.store.dataset import RECIPE_FILE, Dataset
from datasets.store.manifest import MANIFEST_FILE, Entry, read_manifest
from datasets.verify.problems import Kind, Problem, missing_file

WRITE_AGAIN = "`report {}` writes it again from the shards"


def recipe_problem(dataset: Dataset) -> Problem | None:
    """Whether recipe.toml is not the recipe that the manifest was written for."""
    manifest = read_manifest(dataset.root)
    path = dataset.root / RECIPE_FILE
    if manifest is None:
        return None
    kept = manifest.get("recipe_text")
    changed = manifest.get("recipe") != dataset.recipe.digest()
    if changed or (isinstance(kept, str) and kept != path.read_text(encoding="utf-8-sig")):
        text = f"{path} is not the recipe that this dataset was made from; `repair {dataset.root}` puts it back"
        return Problem(path, Kind.CHANGED, text)
    return None


def manifest_problems(dataset: Dataset, sound: Sequence[Entry]) -> Iterator[Problem]:
    """What the manifest lists and is not there, or is not the same. sound: entries of the shards that are sound.

    Shards that it does not list are no fault: a stage that was stopped has made some.
    """
    path = dataset.root / MANIFEST_FILE
    if not path.is_file():
        return
    manifest = read_manifest(dataset.root)
    if manifest is None:
        text = f"{path} is damaged: it is not what was written; {WRITE_AGAIN.format(dataset.root)}"
        yield Problem(path, Kind.DAMAGED, text)
        return
    there = {entry["path"]: entry for entry in sound}
    for entry in manifest["shards"]:
        place = dataset.root / entry["path"]
        if not place.is_file():
            yield missing_file(place)
        elif entry["path"] in there and there[entry["path"]] != entry:
            text = (
                f"{place} is sound but not the one that {MANIFEST_FILE} lists; if it is meant to be there, "
                f"`report {dataset.root}` lists it, else put it aside and run `repair {dataset.root}`"
            )
            yield Problem(place, Kind.CHANGED, text)

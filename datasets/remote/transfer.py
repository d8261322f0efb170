"""A dataset put into an object store, and fetched from one; what is there already is not transferred again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from datasets.errors import UserError
from datasets.recipe.model import load_recipe
from datasets.recipe.small_text import MOST_BYTES
from datasets.remote.places import DERIVED, in_order, is_of_dataset
from datasets.store.atomic import copy_file
from datasets.store.lock import hold
from datasets.store.manifest import read_manifest
from datasets.store.refusals import RECIPE_FILE, refused
from datasets.store.versions import as_begun
from datasets.url_path import UrlPath

COMPARED_BYTES = 2**16  # of the start and of the end of a file: EXR and Parquet have digests of all values there


def upload(root: Path, store: Path, tell: Callable[[str], None] = lambda place: None) -> int:
    """Put a dataset's files into a store; how many were not there yet.

    No file is replaced but those that are made from the others: card, report and manifest. The manifest comes last.

    Raises:
        UserError: no dataset that is whole, another dataset in the store, or the disk refuses.
        UnreachableError: the store refuses.
    """
    if read_manifest(root) is None:
        raise UserError(f"{root} has no manifest that is whole; run `report {root}`, which writes it")
    own, there = _sizes(root), _sizes(store)
    places = in_order(own)
    _refuse_others(root, store, own, there)
    new = [place for place in places if place not in there or place in DERIVED]
    for place in new:
        _copy(root / place, store / place)
        tell(place)
    return sum(place not in there for place in new)


def _refuse_others(root: Path, store: Path, own: dict[str, int], there: dict[str, int]) -> None:
    """Refuse to put a dataset beside files of another."""
    for place in in_order(place for place in there if place not in DERIVED):
        if place not in own:
            raise UserError(f"{store} has {place}, which {root} does not have; choose another folder")
        if own[place] != there[place] or _ends(root / place, own[place]) != _ends(store / place, there[place]):
            raise UserError(f"{store} has another {place} than {root}; choose another folder")


def download(store: Path, root: Path, tell: Callable[[str], None] = lambda place: None) -> int:
    """Fetch a dataset's files into a folder, new, empty or of the same recipe; how many were not there yet.

    What is there is not fetched again; `verify` and `repair` tell and mend what of it is damaged.

    Raises:
        UserError: no dataset in the store, another in the folder, or the disk refuses.
        UnreachableError: the store refuses.
    """
    there = _sizes(store)
    if RECIPE_FILE not in there:
        raise UserError(f"{store} holds no dataset: {RECIPE_FILE} is missing; correct the URL")
    if there[RECIPE_FILE] > MOST_BYTES:
        raise UserError(f"{store} has a {RECIPE_FILE} of {there[RECIPE_FILE]} bytes, which is no recipe")
    _check_folder(root, store)
    _make_folder(root)
    with hold(root):
        new = [place for place in in_order(there) if not (root / place).exists() or place in DERIVED]
        lacking = sum(not (root / place).exists() for place in new)
        for place in new:
            _copy(store / place, root / place)
            tell(place)
    return lacking


def _sizes(folder: Path) -> dict[str, int]:
    """The dataset's files that are in a folder, relative to it, with their bytes."""
    if isinstance(folder, UrlPath):
        found = folder.sizes()
    else:
        files = (path for path in folder.rglob("*") if path.is_file())
        found = {path.relative_to(folder).as_posix(): path.stat().st_size for path in files}
    return {place: size for place, size in found.items() if is_of_dataset(place)}


def _check_folder(root: Path, store: Path) -> None:
    if (root / RECIPE_FILE).is_file():
        own, other = (as_begun(load_recipe(folder / RECIPE_FILE)[0], root).digest() for folder in (root, store))
        if own == other:
            return
        raise UserError(f"{root} holds a dataset of another recipe than {store}; choose another folder")
    if root.exists() and (not root.is_dir() or any(root.iterdir())):
        raise UserError(f"{root} is not an empty folder and holds no dataset; choose a new or empty one")


def _make_folder(root: Path) -> None:
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise refused(root, error) from error


def _copy(source: Path, path: Path) -> None:
    try:
        copy_file(source, path)
    except OSError as error:
        raise refused(path, error) from error


def _ends(path: Path, size: int) -> bytes:
    """The first and the last bytes of a file."""
    start = min(size, COMPARED_BYTES)
    last = min(size - start, COMPARED_BYTES)
    with path.open("rb") as file:
        first = file.read(start)
        file.seek(size - last)
        return first + file.read(last)

"""A dataset put into an object store, and fetched from one; what is there already is not transferred again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pyarrow as pa

from datasets.errors import UserError
from datasets.recipe.model import load_recipe, parse_recipe
from datasets.recipe.small_text import MOST_BYTES
from datasets.remote.places import DERIVED, in_order, is_of_dataset
from datasets.remote.stores import Store, ends_of, unreachable
from datasets.store.atomic import replace_atomically
from datasets.store.lock import hold
from datasets.store.manifest import read_manifest
from datasets.store.refusals import RECIPE_FILE, refused
from datasets.store.versions import as_begun

REFUSED = (OSError, pa.ArrowException)


def upload(root: Path, store: Store, tell: Callable[[str], None] = lambda place: None) -> int:
    """Put a dataset's files into a store; how many were not there yet.

    No file is replaced but those that are made from the others: card, report and manifest. The manifest comes last.

    Raises:
        UserError: no dataset that is whole, another dataset in the store, or the store refuses.
    """
    if read_manifest(root) is None:
        raise UserError(f"{root} has no manifest that is whole; run `report {root}`, which writes it")
    own = {path.relative_to(root).as_posix(): path.stat().st_size for path in root.rglob("*") if path.is_file()}
    places = in_order(place for place in own if is_of_dataset(place))
    try:
        there = store.sizes()
        _refuse_others(root, store, {place: own[place] for place in places}, there)
        new = [place for place in places if place not in there or place in DERIVED]
        for place in new:
            store.put(place, (root / place).read_bytes())
            tell(place)
    except REFUSED as error:
        raise unreachable(store, error) from error
    return sum(place not in there for place in new)


def _refuse_others(root: Path, store: Store, own: dict[str, int], there: dict[str, int]) -> None:
    """Refuse to put a dataset beside files of another."""
    for place in in_order(place for place in there if place not in DERIVED):
        if place not in own:
            raise UserError(f"{store.shown} has {place}, which {root} does not have; choose another folder")
        if own[place] != there[place] or _ends(root / place) != store.ends(place, there[place]):
            raise UserError(f"{store.shown} has another {place} than {root}; choose another folder")


def download(store: Store, root: Path, tell: Callable[[str], None] = lambda place: None) -> int:
    """Fetch a dataset's files into a folder, new, empty or of the same recipe; how many were not there yet.

    What is there is not fetched again; `verify` and `repair` tell and mend what of it is damaged.

    Raises:
        UserError: no dataset in the store, another in the folder, the store or the disk refuses.
    """
    try:
        there = store.sizes()
        if RECIPE_FILE not in there:
            raise UserError(f"{store.shown} holds no dataset: {RECIPE_FILE} is missing; correct the URL")
        if there[RECIPE_FILE] > MOST_BYTES:
            raise UserError(f"{store.shown} has a {RECIPE_FILE} of {there[RECIPE_FILE]} bytes, which is no recipe")
        _check_folder(root, store)
        _make_folder(root)
        with hold(root):
            new = [place for place in in_order(there) if not (root / place).exists() or place in DERIVED]
            lacking = sum(not (root / place).exists() for place in new)
            for place in new:
                _write(root / place, store.read(place))
                tell(place)
    except REFUSED as error:
        raise unreachable(store, error) from error
    return lacking


def _check_folder(root: Path, store: Store) -> None:
    path = root / RECIPE_FILE
    if path.is_file():
        own = as_begun(load_recipe(str(path))[0], root).digest()
        text = store.read(RECIPE_FILE).decode("utf-8", "replace")
        if own == as_begun(parse_recipe(text, f"{store.shown}/{RECIPE_FILE}"), root).digest():
            return
        raise UserError(f"{root} holds a dataset of another recipe than {store.shown}; choose another folder")
    if root.exists() and (not root.is_dir() or any(root.iterdir())):
        raise UserError(f"{root} is not an empty folder and holds no dataset; choose a new or empty one")


def _make_folder(root: Path) -> None:
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise refused(root, error) from error


def _write(path: Path, content: bytes) -> None:
    try:
        with replace_atomically(path) as temporary:
            temporary.write_bytes(content)
    except OSError as error:
        raise refused(path, error) from error


def _ends(path: Path) -> bytes:
    with open(path, "rb") as file:

        def read(offset: int, count: int) -> bytes:
            file.seek(offset)
            return file.read(count)

        return ends_of(read, path.stat().st_size)

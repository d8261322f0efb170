"""A folder becomes the dataset of one recipe, and of one writer."""

from __future__ import annotations

import random
import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from datasets.errors import UserError
from datasets.recipe.model import Recipe, load_recipe
from datasets.store.atomic import TEMPORARY_PREFIX, create_text, sweep, write_text
from datasets.store.dataset import RECIPE_FILE, Dataset
from datasets.store.kept_masters import Kept, settle_kept
from datasets.store.lock import LOCK_PREFIX, hold
from datasets.store.provenance import Provenance
from datasets.store.refusals import refused
from datasets.store.versions import as_begun
from datasets.url_path import UrlPath

INTENT_PREFIX = ".begin-"  # of a file in an object store that tells which recipe is about to be given to it
DIGITS = 16  # of a recipe's hash in its name
PATIENCE_S, PAUSE_S = 5.0, 1.0  # how long two recipes that meet try, and the longest pause between


@contextmanager
def claim(
    root: Path,
    recipe: Recipe,
    text: str,
    *,
    shared: bool = False,
    provenance: Provenance | None = None,
    kept: Kept = Kept.FILES,
) -> Iterator[Dataset]:
    """Bind a folder to one recipe, so that a second run resumes and another recipe cannot blend in, and hold it.

    Of two that claim a new folder at the same moment one succeeds; so does the other if it has the same recipe and both
    are `shared`. The folder is held while the body runs, as `datasets.store.lock` tells.

    provenance: of what the body writes, for the manifest. kept: how a new dataset keeps its linear images; one that
    has begun goes on as it began.

    Raises:
        UserError: the folder holds another recipe, other files or keeps linear images in another way; another
            process writes it; or it cannot be written.
    """
    _check(root, recipe)
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise refused(root / RECIPE_FILE, error) from error
    with hold(root, shared=shared):
        if not _check(root, recipe):
            _bind(root, recipe, text)
        settle_kept(root, kept)
        sweep(root)
        yield Dataset(root, as_begun(recipe, root), provenance)


def _bind(root: Path, recipe: Recipe, text: str) -> None:
    """Write the recipe into a folder that has none.

    Raises:
        UserError: another recipe was first.
    """
    if not isinstance(root, UrlPath):
        if not create_text(root / RECIPE_FILE, text):
            _check(root, recipe)
        return
    deadline = time.monotonic() + PATIENCE_S
    while rival := _bind_in_store(root, recipe, text):
        if time.monotonic() > deadline:
            told = f"another recipe is being given to {root}; choose another place, or delete {rival} if nothing runs"
            raise UserError(f"{told} there")
        time.sleep(random.uniform(0.0, PAUSE_S))


def _bind_in_store(root: UrlPath, recipe: Recipe, text: str) -> Path | None:
    """Write the recipe into an object store, unless another one is about to be: then the file that says so.

    Nothing can be written there under the condition that it is not there, but whoever lists it sees all that was
    written before. So each writes a file of its own that tells its recipe, then looks for those of other recipes, and
    then for the dataset's recipe: of two at once at least one sees the other, and never do both go on. As both may
    withdraw, they try again. Once the recipe is there the files mean nothing.
    """
    kind = f"{INTENT_PREFIX}{recipe.digest()[:DIGITS]}-"
    intent = root / f"{kind}{secrets.token_hex(8)}"
    write_text(intent, text)
    try:
        others = [path for path in root.glob(f"{INTENT_PREFIX}*") if not path.name.startswith(kind)]
        is_bound = _check(root, recipe)
        if others and not is_bound:
            return others[0]
        if not is_bound:
            write_text(root / RECIPE_FILE, text)
    finally:
        intent.unlink(missing_ok=True)
    for path in root.glob(f"{kind}*"):  # of processes that were killed
        path.unlink(missing_ok=True)
    return None


def _check(root: Path, recipe: Recipe) -> bool:
    """Whether a folder is bound to this recipe already; if not, it is new or empty."""
    path = root / RECIPE_FILE
    if not path.exists():
        if root.exists() and not root.is_dir():
            raise UserError(f"{root} is a file; give a folder to --out")
        own = (TEMPORARY_PREFIX, LOCK_PREFIX, INTENT_PREFIX)
        others = root.exists() and any(not entry.name.startswith(own) for entry in root.iterdir())
        if not path.exists():  # another may have bound it since
            if others:
                raise UserError(f"{root} is not empty and holds no dataset; choose a new or empty folder for --out")
            return False
    if as_begun(load_recipe(path)[0], root).digest() != as_begun(recipe, root).digest():
        raise UserError(f"{root} holds a dataset of another recipe; choose another --out or delete it")
    return True

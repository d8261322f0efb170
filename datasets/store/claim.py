"""A folder becomes the dataset of one recipe, and of one writer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from datasets.errors import UserError
from datasets.recipe.model import Recipe, load_recipe
from datasets.store.atomic import TEMPORARY_PREFIX, create_text, sweep
from datasets.store.dataset import RECIPE_FILE, Dataset
from datasets.store.linear_images import settle_kept
from datasets.store.lock import LOCK_PREFIX, hold
from datasets.store.provenance import Provenance
from datasets.store.refusals import refused
from datasets.store.versions import as_begun


@contextmanager
def claim(
    root: Path,
    recipe: Recipe,
    text: str,
    *,
    shared: bool = False,
    provenance: Provenance | None = None,
    keep_masters: bool = True,
) -> Iterator[Dataset]:
    """Bind a folder to one recipe, so that a second run resumes and another recipe cannot blend in, and hold it.

    Of two that claim a new folder at the same moment one succeeds; so does the other if it has the same recipe and both
    are `shared`. The folder is held while the body runs, as `datasets.store.lock` tells.

    provenance: of what the body writes, for the manifest. keep_masters: whether a new dataset keeps its linear images;
    one that has begun goes on as it began.

    Raises:
        UserError: the folder holds another recipe, other files or linear images that are not to be kept; another
            process writes it; or it cannot be written.
    """
    _check(root, recipe)
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise refused(root / RECIPE_FILE, error) from error
    with hold(root, shared=shared):
        if not _check(root, recipe) and not create_text(root / RECIPE_FILE, text):
            _check(root, recipe)
        settle_kept(root, keep=keep_masters)
        sweep(root)
        yield Dataset(root, as_begun(recipe, root), provenance)


def _check(root: Path, recipe: Recipe) -> bool:
    """Whether a folder is bound to this recipe already; if not, it is new or empty."""
    path = root / RECIPE_FILE
    if not path.exists():
        if root.exists() and not root.is_dir():
            raise UserError(f"{root} is a file; give a folder to --out")
        own = (TEMPORARY_PREFIX, LOCK_PREFIX)
        others = root.exists() and any(not entry.name.startswith(own) for entry in root.iterdir())
        if not path.exists():  # another may have bound it since
            if others:
                raise UserError(f"{root} is not empty and holds no dataset; choose a new or empty folder for --out")
            return False
    if as_begun(load_recipe(str(path))[0], root).digest() != as_begun(recipe, root).digest():
        raise UserError(f"{root} holds a dataset of another recipe; choose another --out or delete it")
    return True

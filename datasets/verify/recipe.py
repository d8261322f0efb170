"""recipe.toml, put back from the manifest, which keeps its text."""

from __future__ import annotations

from pathlib import Path

from datasets.errors import UserError
from datasets.recipe.model import load_recipe, parse_recipe
from datasets.store.atomic import write_text
from datasets.store.manifest import read_manifest
from datasets.store.quarantine import put_aside
from datasets.store.refusals import RECIPE_FILE
from datasets.store.versions import as_begun


def kept_recipe(root: Path) -> str | None:
    """The text of the recipe that a dataset's shards were made from, as the manifest keeps it.

    None where it keeps none that has the hash which the manifest states.
    """
    manifest = read_manifest(root) or {}
    text = manifest.get("recipe_text")
    if not isinstance(text, str):
        return None
    try:
        recipe = as_begun(parse_recipe(text, "recipe"), root)
    except UserError:
        return None
    return text if recipe.digest() == manifest["recipe"] else None


def restore_recipe(root: Path) -> bool:
    """Put recipe.toml back as the manifest keeps it; what was in its place is put aside. Whether that was needed.

    Raises:
        UserError: the disk or its permissions refuse.
    """
    path, text = root / RECIPE_FILE, kept_recipe(root)
    if text is None or _has_text(path, text):
        return False
    if path.exists():
        put_aside(root, path)
    write_text(path, text)
    return True


def unreadable_recipe(root: Path) -> str | None:
    """What is wrong with a dataset's recipe where `restore_recipe` can mend it; None if it can be read."""
    try:
        load_recipe(root / RECIPE_FILE)
    except UserError as error:
        return f"{error}; `repair {root}` puts back the one that the manifest keeps" if kept_recipe(root) else None
    return None


def _has_text(path: Path, text: str) -> bool:
    try:
        return path.read_text(encoding="utf-8-sig") == text
    except (OSError, UnicodeDecodeError):
        return False

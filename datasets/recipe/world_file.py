"""A recipe's text with its world's file as an absolute path with a hash, so that a dataset tells which file it had."""

from __future__ import annotations

import json
import tomllib
from collections.abc import MutableMapping
from pathlib import Path
from typing import Any

from tomlkit import TOMLDocument

from datasets.errors import UserError
from datasets.recipe.toml_text import changed_text
from render.world.files import file_digest


def with_world_file(text: str, folder: Path, source: str) -> str:
    """The TOML text with `world.file` found from a folder and `world.file_sha256`; a text without a file stays.

    text: it may be wrong in any way, which whoever reads it as a recipe says. A hash that is given stays: the file need
    not be there then, as in a dataset that was moved.

    Raises:
        UserError: the file cannot be read or used, or the text is written so that the values cannot be put into it.
    """
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError):  # no TOML, or a number of thousands of digits
        return text
    world = data.get("world")
    if not isinstance(world, dict) or not isinstance(world.get("file"), str) or not world["file"]:
        return text
    path = (folder / world["file"]).absolute()
    try:
        values = {"file": str(path), "file_sha256": world.get("file_sha256") or file_digest(path)}
    except (ValueError, TypeError) as error:  # TypeError: in an object store, where no scene is read
        raise UserError(f"{source}: {error}") from None
    if all(world.get(key) == value for key, value in values.items()):
        return text
    changed = changed_text(text, lambda document: _put(document, values), data | {"world": world | values})
    if changed is None:
        lines = ", ".join(f"{key} = {json.dumps(value)}" for key, value in values.items())
        raise UserError(f"cannot put the world's file into {source}; write {lines} under [world] there")
    return changed


def _put(document: TOMLDocument, values: dict[str, str]) -> str:
    world: Any = document["world"]
    assert isinstance(world, MutableMapping)
    for key, value in values.items():
        world[key] = value
    return document.as_string()

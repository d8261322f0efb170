"""A recipe's text with its cameras written out, so that what it says does not depend on files elsewhere."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator
from typing import Any

import tomlkit
from tomlkit import TOMLDocument
from tomlkit.items import AoT, Item, Table

from datasets.errors import UserError
from datasets.recipe.camera_sets import camera_entries, entry_cameras, names_cameras, resolved
from datasets.recipe.toml_text import changed_text


def written_out(text: str, source: str) -> str:
    """The TOML text with values instead of the names of camera sets, and these names as comments.

    The cameras then stand last. Everything else stays as it is, comments too; a text that names no set does not change.

    text: a recipe that can be read. source: names it in messages.

    Raises:
        UserError: the text is written so that the cameras cannot be replaced.
    """
    data = tomllib.loads(text)
    if not any(map(names_cameras, camera_entries(data["cameras"]))):
        return text
    wanted = data | {"cameras": resolved(data["cameras"], source)}
    changed = changed_text(text, lambda document: _write_cameras(document, source), wanted)
    if changed is None:
        raise UserError(f"cannot write out the cameras of {source}; give them last there, each under [[cameras]]")
    return changed


def _write_cameras(document: TOMLDocument, source: str) -> str:
    cameras = document.item("cameras")
    document.remove("cameras")
    if isinstance(cameras, AoT):
        tables = [table for entry in cameras.body for table in _tables(entry, source)]
    else:
        assert isinstance(cameras, Item)  # a text or an array
        named = f"cameras = {cameras.as_string()}{cameras.trivia.comment_ws}{cameras.trivia.comment}"
        tables = [_commented(named), *_written(resolved(cameras.unwrap(), source))]
    return "\n".join([document.as_string().rstrip() + "\n", *tables])


def _tables(entry: Table, source: str) -> Iterator[str]:
    """What one `[[cameras]]` becomes: it stays as it is if it names no set."""
    text = f"[[cameras]]{entry.trivia.comment_ws}{entry.trivia.comment}\n{entry.as_string()}"
    if names_cameras(entry.unwrap()):
        yield _commented(text)
        yield from _written(entry_cameras(entry.unwrap(), source))
    else:
        yield text.rstrip() + "\n"


def _written(cameras: Iterable[Any]) -> Iterator[str]:
    yield from (tomlkit.dumps({"cameras": [camera]}) for camera in cameras)


def _commented(text: str) -> str:
    return "".join(f"# {line}\n" for line in text.strip().splitlines() if line.strip())

"""The manifest: every shard with its hash, the hashes of all and of the frames alone, and what made them.

Hashes are of decoded content, without times, versions or machine. Those stand beside them as provenance: one entry for
each environment that has changed a shard, with the date of its first change. The shards are the source of truth, and
the hashes can be made again from them; the provenance of a lost manifest is lost.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from datasets.recipe.model import Recipe
from datasets.schema import TABLES
from datasets.store.digest import combined_digest
from datasets.store.provenance import Provenance
from datasets.store.refusals import RECIPE_FILE, SHARD_NAME, damaged, unreadable
from datasets.store.shard_file import DIGEST_KEY, UNREADABLE, VERSION_KEY, read_footer

MANIFEST_FILE = "manifest.json"
Entry = dict[str, Any]


def shard_entry(root: Path, path: Path) -> Entry:
    """What the manifest says of a shard.

    Raises:
        UserError: it cannot be read.
    """
    try:
        footer = read_footer(path)
    except PermissionError:
        raise unreadable(path) from None
    except UNREADABLE:
        raise damaged(path) from None
    found = footer.metadata or {}
    version, content = (found.get(key, b"").decode("utf-8", "replace") for key in (VERSION_KEY, DIGEST_KEY))
    place = path.relative_to(root).as_posix()
    return {"path": place, "rows": footer.num_rows, "schema_version": version, "content": content}


def content_of(recipe: str, entries: Sequence[Entry]) -> str:
    """The hash of a dataset. recipe: its recipe's."""
    return combined_digest(recipe, ((entry["path"], entry["content"]) for entry in entries))


def frames_content_of(entries: Sequence[Entry]) -> str:
    """The hash of the frames alone: images, poses and cameras, whatever was detected and estimated since."""
    frames = [entry for entry in entries if entry["path"].startswith("frames/")]
    return combined_digest("", ((entry["path"], entry["content"]) for entry in frames))


def manifest_text(root: Path, recipe: Recipe, entries: Sequence[Entry], provenance: Provenance | None) -> str:
    """The manifest of a dataset's folder as JSON. provenance: None leaves it as it is.

    It keeps the text of recipe.toml, which nothing else could restore.
    """
    digest = recipe.digest()
    manifest = {
        "recipe": digest,
        "content": content_of(digest, entries),
        "frames_content": frames_content_of(entries),
        "made_with": _made_with(read_manifest(root) or {}, entries, provenance),
        "recipe_text": (root / RECIPE_FILE).read_text(encoding="utf-8-sig"),
        "shards": entries,
    }
    return json.dumps(manifest, indent=1) + "\n"


def read_manifest(root: Path) -> Entry | None:
    """The manifest of a dataset's folder if it is whole: its hash is that of its entries, which are shards here."""
    try:
        found = json.loads((root / MANIFEST_FILE).read_text(encoding="utf-8"))
        is_whole = found["content"] == content_of(found["recipe"], found["shards"])
        return found if is_whole and all(_is_place(entry["path"]) for entry in found["shards"]) else None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None


def _is_place(place: str) -> bool:
    table, _, name = place.partition("/")
    return table in TABLES and SHARD_NAME.fullmatch(name) is not None


def _made_with(existing: Entry, entries: Sequence[Entry], provenance: Provenance | None) -> list[Entry]:
    known = list(existing.get("made_with", []))
    if provenance is None or (existing and _contents(existing["shards"]) == _contents(entries)):
        return known
    own = provenance.entry()
    return known if any(entry | {"date": own["date"]} == own for entry in known) else [*known, own]


def _contents(entries: Sequence[Entry]) -> list[tuple[str, str]]:
    return [(entry["path"], entry["content"]) for entry in entries]

"""What the footers of shards say, kept beside the manifest, so that each footer is read once and not at every stage.

A shard counts as the same while its size, its times and its inode are those that were noted: whatever replaces or
changes a file changes one of them. The file may be deleted at any time; `verify` does not use it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from datasets.store.atomic import write_text
from datasets.store.manifest import Entry, shard_entry
from datasets.url_path import UrlPath

KNOWN_FILE = ".known-shards.json"
FORM = {"path": str, "rows": int, "schema_version": str, "content": str}  # of an entry
Mark = list[int]


def entries_of(root: Path, paths: Sequence[Path]) -> list[Entry]:
    """What the manifest says of shards, in their order; only footers that are new or changed are read.

    Raises:
        UserError: a shard cannot be read, or the disk refuses.
    """
    known = _read(root)
    found: dict[str, tuple[Mark, Entry]] = {}
    for path in paths:
        place, mark = path.relative_to(root).as_posix(), _mark(path)
        noted = known.get(place)
        found[place] = noted if noted and mark and noted[0] == mark else (mark, shard_entry(root, path))
    if found != known and any(mark for mark, _ in found.values()):
        write_text(root / KNOWN_FILE, json.dumps(found))
    return [entry for _, entry in found.values()]


def _mark(path: Path) -> Mark:
    """What tells a file from an earlier one of its name; nothing of one that is gone, or in an object store."""
    if isinstance(path, UrlPath):
        return []
    with suppress(OSError):
        told = path.stat()
        return [told.st_size, told.st_mtime_ns, told.st_ctime_ns, told.st_ino]
    return []


def _read(root: Path) -> dict[str, tuple[Mark, Entry]]:
    """What was kept, as far as it has the right form."""
    try:
        kept = json.loads((root / KNOWN_FILE).read_text(encoding="utf-8"))
        return {place: (mark, entry) for place, (mark, entry) in kept.items() if _is_entry(place, entry)}
    except (OSError, ValueError, TypeError, AttributeError, RecursionError):
        return {}


def _is_entry(place: str, entry: Any) -> bool:
    is_whole = isinstance(entry, dict) and set(entry) == set(FORM)
    return is_whole and entry["path"] == place and all(isinstance(entry[key], kind) for key, kind in FORM.items())

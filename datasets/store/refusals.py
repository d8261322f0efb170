"""What is wrong with a file of a dataset, as one sentence that says what to do."""

from __future__ import annotations

import errno
import os
import re
from pathlib import Path

from datasets.errors import UserError

RECIPE_FILE = "recipe.toml"
SHARD_NAME = re.compile(r"([^.].*)-\d{5,}-of-(\d{5,})\.parquet")  # temporary and foreign files have other names


class ForeignShardError(UserError):
    """A sound shard that does not belong where it lies."""


def missing(path: Path) -> UserError:
    """A shard that is not there."""
    return UserError(f"{path} is missing; run the {stage_of(path)} stage first")


def damaged(path: Path, what: str = "it cannot be read") -> UserError:
    """A shard that does not hold what was written to it. what: how that shows."""
    return UserError(f"{path} is damaged: {what}; `repair {path.parent.parent}` makes it again")


def foreign(path: Path, what: str = "to another recipe") -> ForeignShardError:
    """A sound shard that does not belong where it lies. what: where it belongs."""
    return ForeignShardError(
        f"{path} belongs {what}; `repair {path.parent.parent}` puts it aside and makes the right one"
    )


def unreadable(path: Path) -> UserError:
    """A shard that this user may not read: it may be sound, so it is not to be deleted."""
    return UserError(f"cannot read {path}: this user has no permission; ask its owner for it")


def unsupported(path: Path, version: str, readable: tuple[str, ...]) -> UserError:
    """A shard of a version of the schema that is not known here."""
    return UserError(
        f"{path} has schema version {version}, and this program reads {' and '.join(readable)}; use the program that "
        "wrote it, or make the dataset again in another folder"
    )


def refused(path: Path, error: OSError) -> UserError:
    """What the operating system refused."""
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return UserError(
            f"cannot write {path}: the folder is read-only for this user; make it writable, choose another --out, or "
            "work on a copy"
        )
    if error.errno == errno.ENOSPC:
        return UserError(f"cannot write {path}: the disk is full; free space and run again, finished shards are kept")
    return UserError(f"cannot write {path}: {os.strerror(error.errno) if error.errno else error}; choose another --out")


def stage_of(path: Path) -> str:
    """The stage that makes a table's files; for another detector's points with the option that names it."""
    stages = {"detections": "detect", "estimates": "estimate", "scores": "score", "bounds": "bound"}
    stage = stages.get(path.parent.name, "generate")
    shard = SHARD_NAME.fullmatch(path.name)
    variant = shard[1] if shard and stage == "detect" and shard[1] != path.parent.name else ""
    return f"{stage} --detector {variant}" if variant else stage

"""The linear images of a shard put into its archive, and taken out again."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

from datasets.plan import frame_count, frame_ids_of_shard, frames_of_shard, shard_frames
from datasets.recipe.model import Recipe
from datasets.store.atomic import write_bytes
from datasets.store.linear_images import MASTERS, LinearImageError, linear_key, linear_path
from datasets.store.masters import (
    Master,
    archive_names,
    archive_path,
    master_bytes,
    packed_bytes,
    read_packed,
    shard_of,
)
from datasets.store.zip_archive import DamagedArchiveError, write_archive

IMAGE_NAME = re.compile("[0-9]{6,12}[.]exr")


def single_files(root: Path) -> list[int]:
    """The frames whose linear image is there by itself; one look into the folder."""
    found = (int(path.stem) for path in (root / MASTERS).glob("[!.]*.exr") if IMAGE_NAME.fullmatch(path.name))
    return sorted(found)


def pack_masters(root: Path, shard: range) -> None:
    """Pack the linear images of a shard, all of which are sound; its archive stays where no image is newer.

    Raises:
        OSError: the system refuses.
    """
    loose = [frame_id for frame_id in single_files(root) if frame_id in shard]
    if not loose and (root / archive_path(shard)).is_file():
        return
    contents = (master_bytes(Master(root, frame_id, "", shard)) for frame_id in shard)
    write_archive(root / archive_path(shard), archive_names(shard), contents)
    for frame_id in loose:
        (root / linear_path(frame_id)).unlink(missing_ok=True)


def drop_packed_files(root: Path, recipe: Recipe) -> None:
    """Remove single files that the archive of their shard holds bit by bit: whoever packed them was stopped.

    Raises:
        OSError: the system refuses.
    """
    for frame_id in single_files(root):
        if frame_id < frame_count(recipe):
            master = Master(root, frame_id, "", shard_of(recipe, frame_id))
            with suppress(DamagedArchiveError, FileNotFoundError):
                if master.is_packed and master.file.read_bytes() == packed_bytes(master):
                    master.file.unlink(missing_ok=True)


def unpack_sound(root: Path, recipe: Recipe, archive: Path) -> None:
    """Write what is sound in a damaged archive of a dataset to single files, so that it is not rendered again.

    Raises:
        OSError: the system refuses.
    """
    index = int(archive.name.partition("-")[0]) // shard_frames(recipe)
    shard = frame_ids_of_shard(recipe, index)
    for frame in frames_of_shard(recipe, index):
        master = Master(root, frame.frame_id, linear_key(recipe, frame), shard)
        if not master.file.is_file():
            with suppress(LinearImageError, DamagedArchiveError):
                read_packed(master)
                write_bytes(master.file, packed_bytes(master))

"""Pictures and linear light from another dataset: what was rendered once need not be rendered again."""

from __future__ import annotations

import errno
import itertools
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from datasets.errors import UserError
from datasets.plan import shard_count, shard_frames
from datasets.store.atomic import copy_file, write_bytes
from datasets.store.dataset import Dataset, open_dataset
from datasets.store.kept_masters import Kept, kept_of, require_kept
from datasets.store.linear_images import LinearImageError
from datasets.store.masters import Master, archive_names, archive_path, master_bytes, masters, read_master
from datasets.store.refusals import missing, refused
from datasets.store.zip_archive import DamagedArchiveError, check_layout
from datasets.url_path import UrlPath


def reuse_linear_images(dataset: Dataset, source: Path) -> tuple[int, int]:
    """Link or copy into a dataset every master that it lacks and that `source` has, by the key of what it shows.

    Returns:
        How many masters were taken, and how many the dataset lacked.

    Raises:
        UserError: `source` holds no dataset or no linear images, is this dataset itself, or the disk or its permissions
            refuse.
    """
    if source.resolve() == dataset.root.resolve():
        raise UserError(f"--reuse {source} is the dataset that is to be made; give the folder of another one")
    offered = {master.key: master for master in masters(source, source_of(source).recipe)}
    lacking = [master for master in _wanted(dataset) if not master.is_there]
    found = ((master, offered[master.key]) for master in lacking if master.key in offered)
    taken = [(master, other) for master, other in found if _is_sound(other)]
    for _, pairs in itertools.groupby(taken, lambda pair: pair[0].archive):
        shard = list(pairs)
        try:
            _take(shard)
        except OSError as error:
            raise refused(shard[0][0].file, error) from error
    return len(taken), len(lacking)


def _take(shard: Sequence[tuple[Master, Master]]) -> None:
    """Link or copy masters of one shard of a dataset, each with its source; as a whole if both have the same archive.

    Raises:
        OSError: the system refuses.
    """
    archives = _same_archives(shard)
    if archives is not None:
        _link_or_copy(*archives)
        return
    for master, other in shard:
        if other.file.is_file():
            _link_or_copy(other.file, master.file)
        else:
            write_bytes(master.file, master_bytes(other))


def _same_archives(shard: Sequence[tuple[Master, Master]]) -> tuple[Path, Path] | None:
    """The archive of the sources and of the masters, if all of a shard are taken from one of the same frames."""
    master, other = shard[0]
    if master.shard is None or other.shard != master.shard or len(shard) != len(master.shard):
        return None
    if any(own.frame_id != its.frame_id or its.file.is_file() for own, its in shard):
        return None
    source, path = (each.root / archive_path(master.shard) for each in (other, master))
    with suppress(DamagedArchiveError):
        check_layout(source, archive_names(master.shard))
        return source, path
    return None


def share_pictures(dataset: Dataset, source: Dataset) -> None:
    """Link or copy into a dataset the pictures and their truth of another of the same recipe; what is there stays.

    Raises:
        UserError: `source` lacks some, or the disk or its permissions refuse.
    """
    count = shard_count(dataset.recipe)
    for path in (source.shard_path(table, i, count) for table in ("frames", "keypoints") for i in range(count)):
        if not source.is_done(path):
            raise missing(path)
        place = dataset.root / path.relative_to(source.root)
        if not dataset.is_done(place):
            try:
                _link_or_copy(path, place)
            except OSError as error:
                raise refused(place, error) from error


def source_of(folder: Path) -> Dataset:
    """The dataset that is to give linear images.

    Raises:
        UserError: there is none, or it does not keep them.
    """
    source = open_dataset(folder)
    require_kept(folder, "--reuse")
    return source


def _wanted(dataset: Dataset) -> Iterator[Master]:
    """The linear images that a dataset needs: all, or if none is kept those still to be developed."""
    kept, size, count = kept_of(dataset.root), shard_frames(dataset.recipe), shard_count(dataset.recipe)
    for i, master in enumerate(masters(dataset.root, dataset.recipe)):
        if kept is not Kept.NOT or not dataset.is_done(dataset.shard_path("frames", i // size, count)):
            yield master


def _is_sound(master: Master) -> bool:
    try:
        read_master(master)
    except LinearImageError:
        return False
    return True


def _link_or_copy(source: Path, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(path, UrlPath) or isinstance(source, UrlPath):
        copy_file(source, path)
        return
    try:
        os.link(source, path)
    except FileExistsError:  # another process of this dataset was first
        return
    except OSError as error:  # another disk, or a file system or a policy without links
        if error.errno not in (errno.EXDEV, errno.EPERM, errno.EACCES, errno.EMLINK, errno.ENOTSUP, errno.ENOSYS):
            raise
        copy_file(source, path)

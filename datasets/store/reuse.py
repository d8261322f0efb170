"""Pictures and linear light from another dataset: what was rendered once need not be rendered again."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from pathlib import Path

from datasets.errors import UserError
from datasets.plan import shard_count, shard_frames
from datasets.store.atomic import copy_file
from datasets.store.dataset import Dataset, open_dataset
from datasets.store.linear_images import LinearImageError, are_kept, masters, read_linear, require_kept
from datasets.store.refusals import missing, refused
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
    offered = {key: path for path, key in masters(source, source_of(source).recipe)}
    lacking = [(path, key) for path, key in _wanted(dataset) if not path.is_file()]
    taken = [(path, offered[key]) for path, key in lacking if key in offered and _is_sound(offered[key], key)]
    for path, other in taken:
        try:
            _link_or_copy(other, path)
        except OSError as error:
            raise refused(path, error) from error
    return len(taken), len(lacking)


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


def _wanted(dataset: Dataset) -> Iterator[tuple[Path, str]]:
    """Path and key of the linear images that a dataset needs: all, or if none is kept those still to be developed."""
    kept, size, count = are_kept(dataset.root), shard_frames(dataset.recipe), shard_count(dataset.recipe)
    for i, (path, key) in enumerate(masters(dataset.root, dataset.recipe)):
        if kept or not dataset.is_done(dataset.shard_path("frames", i // size, count)):
            yield path, key


def _is_sound(path: Path, key: str) -> bool:
    try:
        read_linear(path, key)
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

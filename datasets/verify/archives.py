"""Archives of linear images of a dataset: there, of their frames and no others, and as they were written."""

from __future__ import annotations

from collections.abc import Iterator

from datasets.plan import frame_ids_of_shard, frames_of_shard, shard_count, shard_frames
from datasets.store.dataset import Dataset
from datasets.store.kept_masters import Kept
from datasets.store.linear_images import MASTERS, ForeignImageError, LinearImageError, linear_path
from datasets.store.masters import Master, archive_names, archive_path, master_of, read_master, read_packed
from datasets.store.packing import single_files
from datasets.store.zip_archive import DamagedArchiveError, check_layout
from datasets.verify.problems import Kind, Problem, damaged_file, missing_file, unplanned_file

TABLES_BESIDE = ("frames", "keypoints")  # which are written when the archive is whole


def archive_problems(dataset: Dataset) -> Iterator[Problem]:
    """What is wrong with the linear images of a dataset that packs them."""
    loose: dict[int, list[int]] = {}
    for frame_id in single_files(dataset.root):
        loose.setdefault(frame_id // shard_frames(dataset.recipe), []).append(frame_id)
    for index in range(shard_count(dataset.recipe)):
        problem = _of_archive(dataset, index)
        if problem is not None:
            yield problem
        yield from _of_single_files(dataset, index, loose.get(index, []), is_packed=problem is None)


def unplanned_archives(dataset: Dataset, kept: Kept) -> Iterator[Problem]:
    """Archives beside those of the plan. kept: how the dataset keeps its linear images."""
    count = shard_count(dataset.recipe) if kept is Kept.ARCHIVES else 0
    planned = {dataset.root / archive_path(frame_ids_of_shard(dataset.recipe, index)) for index in range(count)}
    for path in sorted((dataset.root / MASTERS).glob("[!.]*.zip")):
        if path not in planned:
            yield unplanned_file(path, dataset.root)


def _of_archive(dataset: Dataset, index: int) -> Problem | None:
    """What is wrong with the archive of a shard, told of the first image where several are."""
    shard = frame_ids_of_shard(dataset.recipe, index)
    path = dataset.root / archive_path(shard)
    if not path.is_file():
        return missing_file(path)
    try:
        check_layout(path, archive_names(shard))
    except (DamagedArchiveError, OSError) as error:
        what = str(error) if isinstance(error, DamagedArchiveError) else "it cannot be read"
        return damaged_file(path, dataset.root, what)
    faults: list[LinearImageError] = []
    for frame in frames_of_shard(dataset.recipe, index):
        try:
            read_packed(master_of(dataset.root, dataset.recipe, frame, Kept.ARCHIVES))
        except LinearImageError as error:
            faults.append(error)
    if not faults:
        return None
    more = f"; {len(faults) - 1} more of it as well" if faults[1:] else ""
    is_foreign = all(isinstance(fault, ForeignImageError) for fault in faults)
    return Problem(path, Kind.FOREIGN if is_foreign else Kind.DAMAGED, f"{faults[0]}{more}")


def _of_single_files(dataset: Dataset, index: int, loose: list[int], *, is_packed: bool) -> Iterator[Problem]:
    """A shard in the making may have single files, which must be sound; a finished one has none beside its archive.

    loose: the frames that have one. is_packed: whether the archive is there and sound.
    """
    count = shard_count(dataset.recipe)
    tables = [dataset.shard_path(name, index, count) for name in TABLES_BESIDE] if loose else []
    if loose and is_packed and all(map(dataset.is_done, tables)):
        yield from (unplanned_file(dataset.root / linear_path(frame_id), dataset.root) for frame_id in loose)
        return
    for frame in frames_of_shard(dataset.recipe, index) if loose else ():
        master = master_of(dataset.root, dataset.recipe, frame, Kept.ARCHIVES)
        problem = single_file_problem(master) if frame.frame_id in loose else None
        if problem is not None:
            yield problem


def single_file_problem(master: Master) -> Problem | None:
    """What is wrong with a linear image that is there by itself; None if nothing."""
    try:
        read_master(master)
    except LinearImageError as error:
        kind = Kind.FOREIGN if isinstance(error, ForeignImageError) else Kind.DAMAGED
        return Problem(master.file, kind, str(error))
    return None

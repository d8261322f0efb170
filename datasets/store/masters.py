"""The linear images of a dataset, called masters: where each lies, read in one way whether packed or not.

The masters of a shard that is packed lie in one archive, `masters/FIRST-LAST.zip`, named by its first and last frame.
While the shard is made each is a file, so that a run which is killed renders none of them twice. The archive is written
as a whole, then the single files are removed, then the shard's tables are written. Until then an image may be there in
both forms; the single file counts, as it is the newer one.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from datasets.plan import Frame, frame_ids_of_shard, plan, shard_frames
from datasets.recipe.model import Recipe
from datasets.store.kept_masters import Kept, kept_of
from datasets.store.linear_images import (
    MASTERS,
    LinearImageError,
    linear_key,
    linear_name,
    linear_path,
    read_linear,
    read_linear_bytes,
)  # fmt: skip
from datasets.store.zip_archive import DamagedArchiveError, read_member
from render.frame import LinearImage


@dataclass(frozen=True, slots=True)
class Master:
    """A frame's linear image: where it may lie, and what decides it."""

    root: Path  # of the dataset
    frame_id: int
    key: str
    shard: range | None  # the frames that lie in one archive with it; None where nothing is packed

    @property
    def file(self) -> Path:
        """Where it lies by itself."""
        return self.root / linear_path(self.frame_id)

    @property
    def archive(self) -> Path | None:
        """Where it lies with those of its shard."""
        return None if self.shard is None else self.root / archive_path(self.shard)

    @property
    def is_packed(self) -> bool:
        """Whether its archive is there."""
        return self.archive is not None and self.archive.is_file()

    @property
    def is_there(self) -> bool:
        """Whether it is there in either form."""
        return self.file.is_file() or self.is_packed


def archive_path(shard: range) -> str:
    """Path of the archive of a shard's linear images in its dataset's folder. shard: the numbers of its frames."""
    return f"{MASTERS}/{shard[0]:06d}-{shard[-1]:06d}.zip"


def archive_names(shard: range) -> list[str]:
    """The members of an archive in their order."""
    return [linear_name(frame_id) for frame_id in shard]


def shard_of(recipe: Recipe, frame_id: int) -> range:
    """The numbers of the frames in the same shard."""
    return frame_ids_of_shard(recipe, frame_id // shard_frames(recipe))


def master_of(root: Path, recipe: Recipe, frame: Frame, kept: Kept) -> Master:
    """The linear image of a frame. kept: how the dataset keeps them."""
    shard = shard_of(recipe, frame.frame_id) if kept is Kept.ARCHIVES else None
    return Master(root, frame.frame_id, linear_key(recipe, frame), shard)


def masters(root: Path, recipe: Recipe) -> Iterator[Master]:
    """Every frame's linear image."""
    kept = kept_of(root)
    return (master_of(root, recipe, frame, kept) for frame in plan(recipe))


def read_master(master: Master) -> LinearImage:
    """A linear image, wherever it lies.

    Raises:
        LinearImageError: it is missing, damaged, not one of ours, or made from something else than its key tells.
    """
    if master.file.is_file() or not master.is_packed:
        return read_linear(master.file, master.key)
    return read_packed(master)


def read_packed(master: Master) -> LinearImage:
    """A linear image of a shard whose archive is there. Errors as `read_master`."""
    place = f"{master.archive}, {master.file.name},"
    try:
        content = packed_bytes(master)
    except DamagedArchiveError as error:
        raise LinearImageError(
            f"{master.archive} is damaged: {error}; `repair {master.root}` makes it again"
        ) from error
    except OSError as error:
        raise LinearImageError(f"{place} cannot be read; `repair {master.root}` makes it again") from error
    return read_linear_bytes(content, master.key, place, master.root)


def master_bytes(master: Master) -> bytes:
    """The OpenEXR file of a linear image that is there.

    Raises:
        DamagedArchiveError: its archive is damaged.
        OSError: it cannot be read.
    """
    with suppress(FileNotFoundError):
        return master.file.read_bytes()
    return packed_bytes(master)


def packed_bytes(master: Master) -> bytes:
    """The OpenEXR file of a linear image in its shard's archive. Errors as `master_bytes`."""
    if master.shard is None:
        raise FileNotFoundError(master.file)
    path, number = master.root / archive_path(master.shard), master.frame_id - master.shard[0]
    return read_member(path, archive_names(master.shard), number)

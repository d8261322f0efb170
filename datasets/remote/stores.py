"""Object stores and folders by URL, through pyarrow's file systems."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from urllib.parse import urlsplit

import pyarrow as pa
from pyarrow.fs import FileSelector, FileSystem, FileType

from datasets.errors import UserError
from datasets.remote.places import is_of_dataset

SCHEMES = ("s3", "gs", "file")
COMPARED_BYTES = 2**16  # of the start and of the end of a file: EXR and Parquet have digests of all values there


@dataclass(frozen=True)
class Store:
    """A dataset's folder in a file system of pyarrow."""

    files: FileSystem
    folder: str
    shown: str  # the URL without what may be secret in it

    def sizes(self) -> dict[str, int]:
        """The dataset's files that are there, relative to the folder, with their bytes."""
        found = self.files.get_file_info(FileSelector(self.folder, allow_not_found=True, recursive=True))
        places = ((info.path.removeprefix(self.folder).lstrip("/"), info) for info in found)
        return {place: info.size for place, info in places if info.type == FileType.File and is_of_dataset(place)}

    def read(self, place: str) -> bytes:
        """A file as a whole."""
        with self.files.open_input_stream(f"{self.folder}/{place}") as file:
            return file.read()

    def ends(self, place: str, size: int) -> bytes:
        """The first and the last bytes of a file."""
        with self.files.open_input_file(f"{self.folder}/{place}") as file:
            return ends_of(lambda offset, count: file.read_at(count, offset), size)

    def put(self, place: str, content: bytes) -> None:
        """Write a file as a whole. An object store shows it when it is whole, and never a part of it."""
        parent = f"{self.folder}/{place}".rpartition("/")[0]
        if self.files.type_name == "local":
            self.files.create_dir(parent, recursive=True)
        with self.files.open_output_stream(f"{self.folder}/{place}") as file:
            file.write(content)


def ends_of(read: Callable[[int, int], bytes], size: int) -> bytes:
    """read: takes an offset and a number of bytes."""
    start = min(size, COMPARED_BYTES)
    last = min(size - start, COMPARED_BYTES)
    return read(0, start) + read(size - last, last)


def store_of(url: str) -> Store:
    """The store of a URL such as s3://bucket/folder; access keys come from the environment, as for Amazon's own tools.

    Raises:
        UserError: another scheme, no bucket or folder, or options that are not understood.
    """
    parts = urlsplit(url)
    shown = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}{parts.path}"
    if parts.scheme not in SCHEMES or not (parts.netloc or parts.scheme == "file") or not parts.path.strip("/"):
        allowed = ", ".join(f"{scheme}://" for scheme in SCHEMES)
        raise UserError(
            f"{shown!r} is no place for a dataset; give {allowed} with bucket and folder, as s3://bucket/demo"
        )
    try:
        files, folder = FileSystem.from_uri(url)
    except (OSError, ValueError, pa.ArrowException) as error:
        raise UserError(f"{shown} cannot be opened: {_first_line(error)}; correct the URL and its options") from None
    return Store(files, folder.rstrip("/"), shown)


def unreachable(store: Store, error: Exception) -> UserError:
    """What an object store refused, in a sentence."""
    return UserError(
        f"{store.shown} refuses or is not reached: {_first_line(error)}; correct URL, access keys or network and run "
        "the same command again: what is there stays"
    )


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0][:300]

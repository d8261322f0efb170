"""Paths of files in an object store: the folder of a dataset may be a URL, and its files are used as local ones are.

    root = dataset_folder("s3://bucket/demo")       # a UrlPath; of "out/demo" and of "file:///data/demo" a Path
    (root / "recipe.toml").read_text()

A file is read whole or by ranges, and written whole: a store shows an object when all of it has arrived, and then it
takes the place of an earlier one. There are no folders, no links, no locks and no appending. Whatever needs a local
file, such as `open(path)` or a library in C, refuses such a path with a TypeError instead of taking it for a local one.

pyarrow knows no conditional put (If-None-Match), so a file cannot be written under the condition that none is there:
see `datasets.store.claim`.
"""

from __future__ import annotations

import fnmatch
import functools
import io
import os
import stat
from collections.abc import Callable, Generator
from pathlib import Path, PosixPath
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import quote, unquote, urlsplit

from datasets.errors import UserError
from datasets.store_access import ask_no_silent_metadata, patient_for_a_while

if TYPE_CHECKING:
    from pyarrow.fs import FileInfo, FileSystem

SCHEMES = ("s3", "gs")
Result = TypeVar("Result")


class UnreachableError(Exception):
    """An object store that refuses or does not answer, in a sentence.

    It is no OSError and no ValueError, which say of a file that it is missing or damaged: of such a file nothing is
    known.
    """


class UrlPath(PosixPath):
    """A path in an object store. Its first part is the scheme, a colon and what of the URL is not shown."""

    def __str__(self) -> str:
        """The URL without access keys and options; of a path relative to another, as of any."""
        scheme, colon, _ = self.parts[0].partition(":") if self.parts else ("", "", "")
        rest = "/".join(self.parts[1:])
        return f"{scheme}://{'/' if scheme == 'file' else ''}{rest}" if colon else super().__str__()

    def __fspath__(self) -> str:
        raise TypeError(f"{self} is no local file")

    def stat(self, *, follow_symlinks: bool = True) -> os.stat_result:
        """Kind and size; nothing else is known.

        Raises:
            FileNotFoundError: nothing has this name or begins with it.
        """
        from pyarrow.fs import FileType

        info: FileInfo = self._ask(lambda files: files.get_file_info(self._place))
        if info.type == FileType.NotFound:
            raise FileNotFoundError(str(self))
        kind = stat.S_IFREG if info.type == FileType.File else stat.S_IFDIR
        return os.stat_result((kind, 0, 0, 1, 0, 0, info.size or 0, 0, 0, 0))

    def exists(self, *, follow_symlinks: bool = True) -> bool:
        """Whether a file has this name, or some begin with it."""
        return self._is(lambda mode: True)

    def is_file(self, *, follow_symlinks: bool = True) -> bool:
        """Whether a file has this name."""
        return self._is(stat.S_ISREG)

    def is_dir(self, *, follow_symlinks: bool = True) -> bool:
        """Whether the names of some files begin with this one and a slash."""
        return self._is(stat.S_ISDIR)

    def iterdir(self) -> Generator[UrlPath, None, None]:
        """What is in this folder; nothing if there is none."""
        if self._files.type_name == "gcs":  # lists a folder only if it has an object of its own, which none of ours has
            yield from (self / name for name in sorted({place.partition("/")[0] for place in self.sizes()}))
            return
        for info in self._listed(recursive=False):
            yield self / info.path.rpartition("/")[2]

    def glob(self, pattern: str, **_: Any) -> Generator[UrlPath, None, None]:
        """The files in this folder whose name has the pattern, which is for one folder only."""
        from pyarrow.fs import FileType

        for info in self._listed(recursive=False):
            name = info.path.rpartition("/")[2]
            if info.type == FileType.File and fnmatch.fnmatchcase(name, pattern):
                yield self / name

    def sizes(self) -> dict[str, int]:
        """Bytes of every file below, by its path from here."""
        from pyarrow.fs import FileType

        found = ((info.path.removeprefix(self._place).lstrip("/"), info) for info in self._listed(recursive=True))
        return {place: info.size for place, info in found if info.type == FileType.File}

    def open(self, mode: str = "r", buffering: int = -1, encoding: str | None = None, *_: Any, **__: Any) -> Any:
        """The file for reading, which fetches the ranges that are read; text with `r`, bytes with `rb`."""
        if mode not in ("r", "rb"):
            raise ValueError(f"{self} is put as a whole: use `put`")
        raw = _Ranges(self, self._ask(lambda files: files.open_input_file(self._place)))
        return raw if mode == "rb" else io.TextIOWrapper(io.BufferedReader(raw), encoding)

    def read_bytes(self) -> bytes:
        """The file as a whole."""
        with self.open("rb") as file:
            return file.read()

    def read_text(self, encoding: str | None = None, *_: Any, **__: Any) -> str:
        """The file as a whole."""
        return self.read_bytes().decode(encoding or "utf-8")

    def put(self, source: Path) -> None:
        """Write the content of a local file as a whole; what was there is replaced when all of it has arrived.

        One call hands over everything, as a stream that an interruption closes would be taken for whole.
        """
        import pyarrow as pa

        content = pa.memory_map(str(source)).read_buffer() if source.stat().st_size else pa.py_buffer(b"")
        try:
            self._ask(lambda files: self._write(files, content))
        except FileNotFoundError as error:  # gs:// says so of a bucket
            raise unreachable(self, error) from error

    def _write(self, files: FileSystem, content: Any) -> None:
        if files.type_name != "local":
            with files.open_output_stream(self._place) as file:
                file.write(content)
            return
        folder, _, name = self._place.rpartition("/")
        files.create_dir(folder, recursive=True)
        part = f"{folder}/.tmp-{os.getpid()}-{name}"  # a folder shows a file while it grows
        with files.open_output_stream(part) as file:
            file.write(content)
        files.move(part, self._place)

    def unlink(self, missing_ok: bool = False) -> None:
        """Remove the file."""
        try:
            self._ask(lambda files: files.delete_file(self._place))
        except FileNotFoundError:
            if not missing_ok:
                raise

    def rename(self, target: str | os.PathLike[str]) -> UrlPath:
        """Move the file to another path of its store."""
        if not isinstance(target, UrlPath):
            raise TypeError(f"{self} cannot be moved to {target}, which is in no store")
        to = target._place
        if self._files.type_name == "local":
            self._ask(lambda files: files.create_dir(to.rpartition("/")[0], recursive=True))
        self._ask(lambda files: files.move(self._place, to))
        return target

    def mkdir(self, mode: int = 0o777, parents: bool = False, exist_ok: bool = False) -> None:
        """Nothing: a store has no folders."""

    def absolute(self) -> UrlPath:
        """This path."""
        return self

    def resolve(self, strict: bool = False) -> UrlPath:
        """This path."""
        return self

    @property
    def _files(self) -> FileSystem:
        return _file_system(*self.parts[:2])

    @property
    def _place(self) -> str:
        """The path as pyarrow's file system takes it."""
        rest = "/".join(self.parts[1:])
        return f"/{rest}" if self.parts[0].startswith("file:") else rest

    def _listed(self, *, recursive: bool) -> list[FileInfo]:
        from pyarrow.fs import FileSelector

        wanted = FileSelector(self._place, allow_not_found=True, recursive=recursive)
        return self._ask(lambda files: files.get_file_info(wanted))

    def _is(self, kind: Callable[[int], bool]) -> bool:
        try:
            return kind(self.stat().st_mode)
        except FileNotFoundError:
            return False

    def _ask(self, action: Callable[[FileSystem], Result]) -> Result:
        """Let the file system do something.

        Raises:
            FileNotFoundError: there is no such file.
            UnreachableError: it refuses or does not answer.
        """
        import pyarrow as pa

        try:
            return action(self._files)
        except FileNotFoundError:
            raise
        except (OSError, pa.ArrowException) as error:
            raise unreachable(self, error) from error


class _Ranges(io.RawIOBase):
    """A file of a store for reading, whose failures are not taken for those of its content."""

    def __init__(self, path: UrlPath, file: Any) -> None:
        self._path, self._file = path, file

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = 0) -> int:
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        return self._file.tell()

    def read(self, size: int | None = -1) -> bytes:
        try:
            return self._file.read(None if size is None or size < 0 else size)
        except OSError as error:
            raise unreachable(self._path, error) from error

    def readinto(self, buffer: Any) -> int:
        content = self.read(len(buffer))
        buffer[: len(content)] = content
        return len(content)

    def close(self) -> None:
        self._file.close()
        super().close()


def dataset_folder(text: str) -> Path:
    """The folder that a path or a URL means.

    Raises:
        UserError: another scheme, no bucket or folder, or options that are not understood.
    """
    if "://" not in text:
        return Path(text)
    parts = urlsplit(text)
    folder = parts.path.strip("/")
    if parts.scheme == "file" and folder and not parts.netloc:
        return Path(unquote(parts.path))
    shown = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}{parts.path}"
    if parts.scheme not in SCHEMES or not parts.netloc or not folder:
        raise UserError(f"{shown!r} is no place for a dataset; give a folder, or a URL such as s3://bucket/demo")
    keys, _, bucket = parts.netloc.rpartition("@")
    path = UrlPath(f"{parts.scheme}:{quote(keys, safe='')}?{quote(parts.query, safe='')}", bucket, folder)
    try:
        _file_system(*path.parts[:2])
    except UnreachableError as error:
        raise UserError(str(error)) from None
    return path


def unreachable(path: object, error: Exception) -> UnreachableError:
    """What an object store refused, in a sentence."""
    first = (str(error).strip().splitlines() or [type(error).__name__])[0][:300]
    return UnreachableError(
        f"{path} cannot be used: {first}; correct URL, access keys or network and run the same command again: what is "
        "there stays"
    )


@functools.lru_cache(maxsize=8)
def _file_system(first: str, bucket: str) -> FileSystem:
    """pyarrow's file system of paths that begin so; access keys that a URL does not have come from the environment."""
    import pyarrow as pa
    from pyarrow.fs import FileSystem

    scheme, _, rest = first.partition(":")
    keys, _, options = rest.partition("?")
    secret, query = (f"{unquote(keys)}@" if keys else ""), patient_for_a_while(scheme, unquote(options))
    if scheme == "s3" and not keys:
        ask_no_silent_metadata()
    try:
        url = f"{scheme}:///" if scheme == "file" else f"{scheme}://{secret}{bucket}/folder?{query}".rstrip("?")
        return FileSystem.from_uri(url)[0]
    except (OSError, ValueError, pa.ArrowException) as error:
        raise unreachable(f"{scheme}://{bucket}", error) from None

"""ZIP archives that names and contents decide to the last bit, and that are read within limits.

Members are stored, as what is packed here is compressed already. They lie one behind the other, in the order of names
that the reader knows beforehand, with one date and nothing between them. So a header or a directory entry is decided by
a name, a size, a checksum and a place: the reader builds each again, and refuses what differs in any bit. Nothing is
allocated before what is claimed has been held against the size of the file, and no name of a file is used as a path.

Source of the format: PKWARE, APPNOTE.TXT 6.3.10, 4.3.7, 4.3.12 and 4.3.14 to 4.3.16; 4.5.3 for archives that are large.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from datasets.store.atomic import replace_atomically

LOCAL = struct.Struct("<4s5H3I2H")  # in front of a member
ENTRY = struct.Struct("<4s6H3I5H2I")  # of the directory behind all members
FAR = struct.Struct("<2HQ")  # behind the name in an entry of a large archive: where the member lies
END = struct.Struct("<4s4H2IH")
LARGE_END = struct.Struct("<4sQ2H2I4Q")
LOCATOR = struct.Struct("<4sIQI")  # between the two ends
ELSEWHERE = 0xFFFFFFFF  # instead of a place that has 64 bits, in another field
LARGE = ELSEWHERE  # an archive with so many bytes before its directory has places of 64 bits, in all entries
PLAIN_VERSION, LARGE_VERSION, UNIX = 20, 45, 3 << 8  # of the format
DATE = 1 << 5 | 1  # 1980-01-01, the first that there is
MODE = 0o100644 << 16  # a file that its owner may write and all may read


class DamagedArchiveError(ValueError):
    """An archive that does not hold what was written; the message says in a few words what is wrong."""


@dataclass(frozen=True, slots=True)
class _Member:
    """A member of an archive."""

    name: bytes
    size: int
    crc: int
    offset: int  # of its header

    @property
    def header(self) -> bytes:
        """What stands in front of it."""
        return LOCAL.pack(
            b"PK\3\4", PLAIN_VERSION, 0, 0, 0, DATE, self.crc, self.size, self.size, len(self.name), 0
        ) + self.name  # fmt: skip

    @property
    def end(self) -> int:
        """Where the next one begins."""
        return self.offset + LOCAL.size + len(self.name) + self.size

    def entry(self, *, is_large: bool) -> bytes:
        """What the directory says of it."""
        version, near, far = PLAIN_VERSION, self.offset, b""
        if is_large:
            version, near, far = LARGE_VERSION, ELSEWHERE, FAR.pack(1, 8, self.offset)
        return ENTRY.pack(
            b"PK\1\2", UNIX | version, version, 0, 0, 0, DATE, self.crc, self.size, self.size, len(self.name), len(far),
            0, 0, 0, MODE, near,
        ) + self.name + far  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Directory:
    """Where an archive's directory lies, and that of which names it is."""

    names: Sequence[bytes]
    start: int
    is_large: bool

    def place(self, number: int) -> int:
        """Where an entry begins."""
        fixed = ENTRY.size + (FAR.size if self.is_large else 0)
        return self.start + number * fixed + sum(map(len, self.names[:number]))

    @property
    def end(self) -> bytes:
        """What stands behind it."""
        stop, count = self.place(len(self.names)), len(self.names)
        size = stop - self.start
        if not self.is_large:
            return END.pack(b"PK\5\6", 0, 0, count, count, size, self.start, 0)
        large = LARGE_END.pack(
            b"PK\6\6", LARGE_END.size - 12, UNIX | LARGE_VERSION, LARGE_VERSION, 0, 0, count, count, size, self.start
        )
        last = END.pack(b"PK\5\6", 0, 0, count, count, size, ELSEWHERE, 0)
        return large + LOCATOR.pack(b"PK\6\7", 0, stop, 1) + last


def write_archive(path: Path, names: Sequence[str], contents: Iterable[bytes]) -> None:
    """Write an archive of members with their contents, one for each name; atomic.

    Raises:
        OSError: the system refuses.
    """
    members: list[_Member] = []
    with replace_atomically(path) as temporary, temporary.open("wb") as file:
        for name, content in zip(names, contents, strict=True):
            offset = members[-1].end if members else 0
            members.append(_Member(name.encode(), len(content), zlib.crc32(content), offset))
            file.write(members[-1].header)
            file.write(content)
        start = members[-1].end if members else 0
        is_large = start >= LARGE
        for member in members:
            file.write(member.entry(is_large=is_large))
        file.write(_Directory([member.name for member in members], start, is_large).end)


def read_member(path: Path, names: Sequence[str], number: int) -> bytes:
    """The content of one member. names: all that the archive must have, in their order. number: which of them.

    Of the directory only this member's entry is read; `check_layout` reads all.

    Raises:
        DamagedArchiveError: the archive is not of these members, or this one does not hold what was written.
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        directory = _directory_of(file, names)
        place = directory.place(number)
        return _content(file, _member(_read(file, place, directory.place(number + 1)), directory, number))


def check_layout(path: Path, names: Sequence[str]) -> None:
    """Check that the members lie one behind the other in an archive, from its first byte to the directory.

    Raises:
        DamagedArchiveError: they do not, or the archive is not of these members.
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        directory = _directory_of(file, names)
        entries = _read(file, directory.start, directory.place(len(names)))
    at = stop = 0
    for number, name in enumerate(directory.names):
        size = ENTRY.size + len(name) + (FAR.size if directory.is_large else 0)
        member = _member(entries[at : at + size], directory, number)
        if member.offset != stop:
            raise DamagedArchiveError(f"{names[number]} does not lie behind the member before it")
        at, stop = at + size, member.end
    if stop != directory.start:
        raise DamagedArchiveError("there is something between its members and its directory")


def _directory_of(file: Any, names: Sequence[str]) -> _Directory:
    """Where the directory lies, by the end of the file, which must be that of an archive of these names."""
    size = file.seek(0, os.SEEK_END)
    last = _read(file, max(0, size - LARGE_END.size - LOCATOR.size - END.size), size)
    if len(last) >= END.size:
        start = END.unpack(last[-END.size :])[6]
        is_large = start == ELSEWHERE and len(last) == LARGE_END.size + LOCATOR.size + END.size
        if is_large:
            start = LARGE_END.unpack(last[: LARGE_END.size])[9]
        directory = _Directory([name.encode() for name in names], start, is_large)
        end = directory.end if start < size else b""
        if end and last.endswith(end) and directory.place(len(names)) + len(end) == size:
            return directory
    raise _other_archive(names[0], names[-1])


def _other_archive(first: str, last: str) -> DamagedArchiveError:
    return DamagedArchiveError(f"it is no archive of {first} to {last} and nothing else")


def _member(entry: bytes, directory: _Directory, number: int) -> _Member:
    """The member that an entry of the directory describes, which must be the one that is due there."""
    fields = ENTRY.unpack(entry[: ENTRY.size])
    offset = FAR.unpack(entry[-FAR.size :])[2] if directory.is_large else fields[16]
    names = directory.names
    if not entry[ENTRY.size :].startswith(names[number]):
        raise _other_archive(names[0].decode(), names[-1].decode())
    member = _Member(names[number], fields[8], fields[7], offset)
    if member.entry(is_large=directory.is_large) != entry or member.end > directory.start:
        raise DamagedArchiveError(f"its directory does not say of {member.name.decode()} what was written")
    return member


def _content(file: Any, member: _Member) -> bytes:
    stored = _read(file, member.offset, member.end)
    header = member.header
    content = stored[len(header) :]
    if not stored.startswith(header) or zlib.crc32(content) != member.crc:
        raise DamagedArchiveError(f"{member.name.decode()} is not what was written")
    return content


def _read(file: Any, start: int, stop: int) -> bytes:
    file.seek(start)
    found = file.read(stop - start)
    if len(found) != stop - start:
        raise DamagedArchiveError("it ends too early")
    return found

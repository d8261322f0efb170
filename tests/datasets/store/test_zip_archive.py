"""Archives are bits that names and contents decide, any program reads them, and nothing else is taken for one."""

from __future__ import annotations

import random
import zipfile

import pytest

from datasets.store import zip_archive
from datasets.store.zip_archive import DamagedArchiveError, check_layout, read_member, write_archive

NAMES = ["000008.exr", "000009.exr", "000010.exr"]
CONTENTS = [b"first", b"", b"the last one"]


@pytest.fixture(params=["plain", "large"])
def archive(request, tmp_path, monkeypatch):
    """A small archive in the form that each size has."""
    if request.param == "large":
        monkeypatch.setattr(zip_archive, "LARGE", 1)
    path = tmp_path / "archive.zip"
    write_archive(path, NAMES, CONTENTS)
    return path


def fault_of(path, names=NAMES):
    """What any reading of an archive finds; None if its contents are those that were written."""
    try:
        check_layout(path, names)
        found = [read_member(path, names, number) for number in range(len(names))]
    except DamagedArchiveError as error:
        return str(error)
    assert found == CONTENTS
    return None


def test_any_program_reads_it(archive):
    with zipfile.ZipFile(archive) as other:
        assert other.namelist() == NAMES
        assert [other.read(name) for name in NAMES] == CONTENTS
        assert {(item.compress_type, item.date_time) for item in other.infolist()} == {(0, (1980, 1, 1, 0, 0, 0))}
        assert other.testzip() is None
    assert fault_of(archive) is None


def test_the_same_contents_are_the_same_bits(archive, tmp_path):
    write_archive(tmp_path / "again.zip", NAMES, iter(CONTENTS))
    assert (tmp_path / "again.zip").read_bytes() == archive.read_bytes()


def test_a_large_archive_has_members_beyond_four_gigabytes(tmp_path):
    """Its bytes are those that the writer would make; what lies between is a hole in the file."""
    hole = zip_archive._Member(b"000000.exr", 2**32 - 2, 0, 0)
    member = zip_archive._Member(b"000001.exr", 3, 0x352441C2, hole.end)  # the CRC-32 of b"abc"
    directory = zip_archive._Directory([hole.name, member.name], member.end, True)
    path = tmp_path / "large.zip"
    with path.open("wb") as file:
        file.write(hole.header)
        file.seek(member.offset)
        file.write(member.header + b"abc" + hole.entry(is_large=True) + member.entry(is_large=True) + directory.end)
    names = ["000000.exr", "000001.exr"]
    check_layout(path, names)
    assert read_member(path, names, 1) == b"abc"
    with zipfile.ZipFile(path) as other:
        assert other.read("000001.exr") == b"abc"


def test_names_may_differ_in_length(tmp_path):
    names = [f"{number:06d}.exr" for number in range(999_998, 1_000_003)]
    contents = [name.encode() for name in names]
    write_archive(tmp_path / "a.zip", names, contents)
    check_layout(tmp_path / "a.zip", names)
    assert [read_member(tmp_path / "a.zip", names, number) for number in range(5)] == contents


@pytest.mark.parametrize("step", [11, pytest.param(1, marks=pytest.mark.full)])
def test_every_bit_counts(step, archive):
    whole = archive.read_bytes()
    for place in range(0, 8 * len(whole), step):
        data = bytearray(whole)
        data[place // 8] ^= 1 << place % 8
        archive.write_bytes(data)
        assert fault_of(archive) is not None, place


def test_every_byte_counts(archive):
    whole = archive.read_bytes()
    cut = [whole[:size] for size in range(0, len(whole), 3)]
    more = [whole + b"\0", b"\0" + whole, whole + whole, b""]
    for data in [*cut, *more]:
        archive.write_bytes(data)
        assert fault_of(archive) is not None
    rng = random.Random(1)
    for _ in range(50):
        data = bytearray(whole)
        for place in rng.sample(range(len(whole)), 4):
            data[place] = rng.choice((0, 1, 0x7F, 0xFF))
        archive.write_bytes(data)
        assert data == whole or fault_of(archive) is not None


@pytest.mark.parametrize(
    "names",
    [NAMES[:2], NAMES[1:], [*NAMES, "000011.exr"], NAMES[::-1], ["../008.exr", *NAMES[1:]], ["000008.ex", *NAMES[1:]]],
    ids=["few", "later", "many", "order", "path", "other"],
)
def test_only_the_names_that_are_due(names, tmp_path):
    write_archive(tmp_path / "a.zip", names, [b"x"] * len(names))
    assert fault_of(tmp_path / "a.zip") is not None


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_what_another_program_packs_is_refused(method, tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w", method) as other:
        for name, content in zip(NAMES, CONTENTS, strict=True):
            other.writestr(name, content)
    assert fault_of(tmp_path / "a.zip") is not None


def test_what_is_claimed_is_not_allocated(tmp_path):
    """A member, a directory and their places of some exabytes, in a file of 300 bytes."""
    large = zip_archive._Member(b"000008.exr", 2**32 - 1, 0, 0)
    for start in (0, 40, 2**32 - 2, 2**63, 2**64 - 1):
        directory = zip_archive._Directory([large.name], min(start, 2**64 - 200), True)
        (tmp_path / "a.zip").write_bytes(large.header + large.entry(is_large=True) + directory.end)
        assert fault_of(tmp_path / "a.zip", ["000008.exr"]) is not None

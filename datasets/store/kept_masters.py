"""How a dataset keeps its linear images: each as a file, those of a shard packed in an archive, or not at all.

A file in the dataset's folder notes it, so that who resumes need not say it again; without one each is a file.
"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path

from datasets.errors import UserError
from datasets.store.atomic import write_text
from datasets.store.linear_images import MASTERS

NOT_KEPT, PACKED = "masters-not-kept.txt", "masters-packed.txt"
NOT_KEPT_TEXT = """\
This dataset was made with --no-masters: its linear images are rendered, developed and not kept.
Another regime needs them, and so does `--reuse`: make the dataset in another folder without --no-masters.
"""
PACKED_TEXT = """\
This dataset was made with --pack-masters: the linear images of a shard lie in one archive, masters/FIRST-LAST.zip.
Any program for ZIP archives unpacks them; commands that need them read the archives.
"""


class Kept(StrEnum):
    """How a dataset keeps its linear images."""

    FILES = "as single files"
    ARCHIVES = "packed"
    NOT = "not kept"


OPTIONS = {Kept.ARCHIVES: "--pack-masters", Kept.NOT: "--no-masters"}
NOTES = {Kept.ARCHIVES: (PACKED, PACKED_TEXT), Kept.NOT: (NOT_KEPT, NOT_KEPT_TEXT)}


def kept_of(root: Path) -> Kept:
    """How a dataset keeps its linear images."""
    return next((kept for kept, (name, _) in NOTES.items() if (root / name).exists()), Kept.FILES)


def require_kept(root: Path, what: str) -> None:
    """Refuse a dataset that does not keep its linear images. what: the option or command that needs them.

    Raises:
        UserError: it was made with --no-masters.
    """
    if kept_of(root) is Kept.NOT:
        raise UserError(
            f"{what}: {root} was made with --no-masters and has no linear images; give a dataset that keeps them"
        )


def settle_kept(root: Path, wanted: Kept) -> None:
    """Note in a dataset's folder how linear images are kept. wanted: FILES leaves it as it was begun.

    Raises:
        UserError: the dataset has begun in another way, or the folder cannot be written.
    """
    begun = kept_of(root)
    if wanted in (Kept.FILES, begun):
        return
    if begun is Kept.FILES and not _has_begun(root):
        write_text(root / NOTES[wanted][0], NOTES[wanted][1])
        return
    raise UserError(f"{root} {_told(begun)}; leave out {OPTIONS[wanted]}, or choose another --out")


def _told(begun: Kept) -> str:
    if begun is Kept.FILES:
        return "keeps its linear images as single files"
    return f"was begun with {OPTIONS[begun]}"


def _has_begun(root: Path) -> bool:
    return any((root / MASTERS).glob("*.exr")) or any((root / "frames").glob("[!.]*.parquet"))

"""Text files of strangers: only regular ones, and only as large as such a file can sensibly be."""

from __future__ import annotations

import errno
from pathlib import Path

MOST_BYTES = 4_000_000  # of a recipe: ten thousand listed poses have less


def read_small_text(path: Path) -> str:
    """The text of a file in UTF-8, without a byte order mark.

    Raises:
        OSError: it has no possible name, cannot be read, is a device or a pipe, which might never end, or is too
            large; strerror says so.
        UnicodeDecodeError: it is not UTF-8.
    """
    if "\0" in str(path):
        raise OSError(errno.EINVAL, "its name holds a zero byte", str(path))
    if path.exists() and not path.is_dir() and not path.is_file():
        raise OSError(errno.EINVAL, "it is a device or a pipe", str(path))
    with path.open(encoding="utf-8-sig") as file:
        text = file.read(MOST_BYTES + 1)
    if len(text) > MOST_BYTES:
        raise OSError(errno.EFBIG, f"it has more than {MOST_BYTES // 1_000_000} MB", str(path))
    return text

"""OpenEXR files with a digest of what they hold: written whole or not at all, read within limits and checked."""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.recipe.cameras import MAX_PIXELS
from datasets.store.atomic import local_copy, replace_atomically
from datasets.store.silence import silent_library

DIGEST = "digest"  # in the header; files of earlier versions have none
STATED = ("dataWindow", "displayWindow", "key", "region", "background", "objects", "circle")  # what we read of a header
MOST_CHANNELS = 16
MOST_EXPANSION = 1100  # bytes that deflate makes of one: 1032; a file that claims more would only fill the memory
NOT_WRITTEN = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS, errno.EACCES)
Channels = Mapping[str, NDArray[Any]]  # (height, width), or (height, width, 3) for "RGB"
Header = dict[str, Any]


class DamagedExrError(ValueError):
    """A file that does not hold what was written; the message says in a few words what is wrong."""


def write_exr(path: Path, header: Header, channels: Channels) -> None:
    """Write one part of scan lines, with ZIP and a digest; atomic, lossless.

    header: without windows the whole picture is both.

    Raises:
        OSError: the system refuses.
    """
    import OpenEXR

    height, width = next(iter(channels.values())).shape[:2]
    whole = np.array([0, 0], np.int32), np.array([width - 1, height - 1], np.int32)
    stated = {"dataWindow": whole, "displayWindow": whole, **header}
    told = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **stated}
    told[DIGEST] = _digest(stated, channels)
    with replace_atomically(path) as temporary, OpenEXR.File(told, dict(channels)) as file:
        try:
            file.write(str(temporary))
        except RuntimeError as error:  # the library has no other kind of error
            raise _as_os_error(error, path) from error


def read_header(path: Path) -> Header:
    """The header of a file, whose pixels are not read.

    Raises:
        DamagedExrError: it is none of ours, or larger than a picture can be.
        OSError: it cannot be read.
    """
    import OpenEXR

    try:
        with local_copy(path) as here, silent_library(), OpenEXR.File(str(here), header_only=True) as file:
            parts = len(file.parts)
            header, size = dict(file.header()), here.stat().st_size
    except (RuntimeError, ValueError, KeyError, IndexError, MemoryError) as error:
        raise DamagedExrError("it cannot be read") from error
    if parts != 1 or header.get("type") != OpenEXR.scanlineimage:
        raise DamagedExrError("it is not one picture of scan lines")
    _check_size(size, header)
    return header


def read_exr(path: Path, *, check: bool = True) -> tuple[Header, dict[str, NDArray[Any]]]:
    """Header and channels of a file. check: whether they are compared with the digest, where the file has one.

    Raises:
        DamagedExrError: it is not what was written.
        OSError: it cannot be read.
    """
    import OpenEXR

    with local_copy(path) as here:
        header = read_header(here)
        try:
            with silent_library(), OpenEXR.File(str(here)) as file:
                channels = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
        except (RuntimeError, ValueError, KeyError, IndexError, MemoryError) as error:
            raise DamagedExrError("it cannot be read") from error
    if check and DIGEST in header and header[DIGEST] != _digest(header, channels):
        raise DamagedExrError("its values are not those that were written")
    return header, channels


def _digest(header: Header, channels: Channels) -> str:
    """SHA-256 of what we read of a header, and of every channel's name, type, shape and values."""
    told = {name: _plain(header[name]) for name in STATED if name in header}
    total = hashlib.sha256(json.dumps(told, sort_keys=True).encode())
    for name in sorted(channels):
        values = np.ascontiguousarray(channels[name])
        total.update(f"{name}:{values.dtype}:{values.shape};".encode())
        total.update(values.data)
    return total.hexdigest()


def _plain(value: Any) -> Any:
    """A header's value as JSON has it; numbers as the file keeps them, in 32 bits.

    Raises:
        DamagedExrError: a value of a kind that we do not write.
    """
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return [float(number) for number in value.ravel()]
    if isinstance(value, float):
        return float(np.float32(value))
    if not isinstance(value, (int, str)):
        raise DamagedExrError("its header holds a value of another kind than was written")
    return value


def _check_size(size: int, header: Header) -> None:
    low, high = header["dataWindow"]
    width, height = (int(high[i]) - int(low[i]) + 1 for i in (0, 1))
    channels = len(header["channels"])
    if width < 1 or height < 1 or width * height > MAX_PIXELS or not 1 <= channels <= MOST_CHANNELS:
        raise DamagedExrError(f"it claims {width} x {height} pixels of {channels} channels")
    if 4 * width * height * channels > MOST_EXPANSION * size:
        raise DamagedExrError(f"it claims {width} x {height} pixels, more than a file of its size can hold")


def _as_os_error(error: RuntimeError, path: Path) -> OSError:
    """The reason that the library tells in words only."""
    found = next((code for code in NOT_WRITTEN if os.strerror(code) in str(error)), None)
    return OSError(found, os.strerror(found), str(path)) if found else OSError(str(error))

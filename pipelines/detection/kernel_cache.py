"""The folder in which compiled functions are kept for later runs: one for each state of this package's sources.

Numba compiles a function anew when the file that holds it has changed, but not when a function that it calls has
changed in another file: the old machine code would be loaded, with the old function in it. So the folder's name is a
hash of all of the package's sources, and of what else shapes the machine code and is not compared by Numba.
"""

from __future__ import annotations

import hashlib
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import llvmlite
from numba.core import config
from numba.misc.appdirs import AppDirs

from eposit.compiled.cache import own_temporary_folder

PACKAGE = Path(__file__).parent
PREFIX = "eposit-kernels-"
OPTIONS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK")  # of Numba's environment, which shape machine code
OLD_S = 86400.0  # since the last change: a process with these sources has compiled what it needs long ago


def choose_folder(package: Path = PACKAGE) -> Path | None:
    """Folder, made if need be, for what this package compiles; None where no place can be written.

    The places are, in this order: NUMBA_CACHE_DIR where it is set, beside the source, the user's own cache, a folder
    of this user among the temporary files.
    """
    name = PREFIX + hash_of_sources(package)
    beside = package / "__pycache__"
    for place in _places(beside):
        folder = place / name
        is_new = not folder.exists()
        if _can_write(folder):
            if is_new and place == beside:  # other places may hold the folders of other checkouts
                remove_old(place, folder)
            return folder
    return None


def hash_of_sources(package: Path) -> str:
    """Of the names and contents of a package's files, of LLVM's version and of the options that shape its code."""
    digest = hashlib.sha256(repr((llvmlite.__version__, *(getattr(config, name) for name in OPTIONS))).encode())
    for path in sorted(package.glob("*.py")):
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)} ".encode() + content)
    return digest.hexdigest()[:16]


def remove_old(place: Path, keep: Path) -> None:
    """Remove the folders of other sources that nothing has been added to for a day.

    A process that still uses one loses nothing: Numba compiles what it does not find, and makes its folder anew.
    """
    for folder in place.glob(PREFIX + "*"):
        try:
            newest = max(path.stat().st_mtime for path in (folder, *folder.rglob("*")))
        except OSError:  # somebody else is removing it
            continue
        if folder != keep and newest < time.time() - OLD_S:
            shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def numba_keeps_in(folder: Path) -> Iterator[None]:
    """What is decorated with `cache=True` in the body is kept there; what other packages decorate later is not."""
    before = config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue]
    config.CACHE_DIR = str(folder)  # pyright: ignore[reportAttributeAccessIssue]
    try:
        yield
    finally:
        config.CACHE_DIR = before  # pyright: ignore[reportAttributeAccessIssue]


def _places(beside: Path) -> Iterator[Path]:
    if config.CACHE_DIR:  # pyright: ignore[reportAttributeAccessIssue]
        yield Path(config.CACHE_DIR)  # pyright: ignore[reportAttributeAccessIssue]
    yield beside
    users = Path(AppDirs(appname="numba", appauthor=False).user_cache_dir)
    if users.is_absolute():  # it is not for a user without a home
        yield users
    own = own_temporary_folder()
    if own is not None:
        yield own


def _can_write(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True

"""The user's cache of machine code: a file for each function, named by all that shapes it.

The name holds a hash of the sources, of LLVM's version and of the processor; a file begins with a hash of
its content, so that half a file is no file.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import time
from pathlib import Path

OLD_S = 30 * 86400.0  # files of other sources go when they are so old; who needs one compiles again


class Cache:
    """Machine code of one state of the sources."""

    def __init__(self, packages: set[Path], target: tuple[str, ...]):
        """packages: the folders with the sources. target: what else shapes the code."""
        digest = hashlib.sha256(repr(target).encode())
        for path in sorted(path for package in packages for path in package.glob("*.py")):
            content = path.read_bytes()
            digest.update(f"{path.name} {len(content)} ".encode() + content)
        self._hash = digest.hexdigest()[:16]

    def read(self, name: str) -> bytes | None:
        """What was kept under the name; None where there is nothing, or not the whole."""
        for folder in folders():
            try:
                content = (folder / self._file(name)).read_bytes()
            except OSError:
                continue
            if hashlib.sha256(content[32:]).digest() == content[:32]:
                return content[32:]
        return None

    def write(self, name: str, code: bytes) -> None:
        """Keep it in the first folder that can be written; nowhere if none can."""
        for folder in folders():
            try:
                folder.mkdir(parents=True, exist_ok=True)
                _write_whole(folder / self._file(name), hashlib.sha256(code).digest() + code)
            except OSError:
                continue
            _remove_old(folder)
            return

    def _file(self, name: str) -> str:
        return f"{name}-{self._hash}.machine-code"


def folders() -> list[Path]:
    """Where machine code may lie: the user's cache, or a folder of this user among the temporary files."""
    own = own_temporary_folder()
    return [*_users_cache(), *([own] if own else [])]


def _users_cache() -> list[Path]:
    if sys.platform == "win32":
        place = os.environ.get("LOCALAPPDATA", "")
    elif sys.platform == "darwin":
        place = "~/Library/Caches"
    else:
        place = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    folder = Path(place).expanduser()
    return [folder / "eposit"] if folder.is_absolute() else []  # it is not for a user without a home


def own_temporary_folder() -> Path | None:
    """A folder among the temporary files that only this user can write; None if somebody else has it."""
    folder = Path(tempfile.gettempdir()) / f"eposit-kernels-{os.getuid() if hasattr(os, 'getuid') else 'own'}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.stat()
    except OSError:
        return None
    mine = not hasattr(os, "getuid") or (found.st_uid == os.getuid() and found.st_mode & 0o077 == 0)
    return folder if mine and not folder.is_symlink() else None


def _write_whole(path: Path, content: bytes) -> None:
    """Under a temporary name first: another process sees the whole file or none."""
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
        file.write(content)
    Path(file.name).replace(path)


def _remove_old(folder: Path) -> None:
    for path in folder.glob("*.machine-code"):
        try:
            if path.stat().st_mtime < time.time() - OLD_S:
                path.unlink()
        except OSError:  # somebody else is removing it
            continue

"""Which files a user's function is made of, so that a copy of them can be kept."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pipelines.nightly.other_code import PACKAGES

MOST_BYTES = 200_000_000  # of a copy; more, such as weights of a network, is not copied every time it changes
SKIPPED = "__pycache__"
LIBRARIES = frozenset(("site-packages", "dist-packages"))


@dataclass(frozen=True, slots=True)
class UserFiles:
    """Files of a module, of its whole package, and of what it imports from the same folder."""

    root: str  # the folder from which the module is imported
    files: tuple[str, ...]
    why_not: str = ""  # why they cannot be copied


def files_of(module: str) -> UserFiles:
    """The files of a module that has been imported. Libraries are not among them: they are the environment's."""
    origin = getattr(sys.modules[module], "__file__", None)
    if origin is None:
        return UserFiles("", (), f"{module} has no file")
    path, parts = Path(origin).resolve(), module.split(".")
    root = path.parents[len(parts) if path.stem == "__init__" else len(parts) - 1]
    files = sorted({path, *_of_package(root / parts[0]), *_imported(root, parts[0])})
    if sum(item.stat().st_size for item in files) > MOST_BYTES:
        return UserFiles(str(root), (), f"its files have more than {MOST_BYTES // 1_000_000} MB")
    return UserFiles(str(root), tuple(map(str, files)))


def _of_package(folder: Path) -> Iterator[Path]:
    """Every file of a package, also those that are imported or read later; none of a folder that is no package."""
    if (folder / "__init__.py").is_file():
        for path in folder.rglob("*"):
            inner = path.relative_to(folder).parts
            if path.is_file() and SKIPPED not in inner and not any(part.startswith(".") for part in inner):
                yield path.resolve()


def _imported(root: Path, top: str) -> Iterator[Path]:
    """Files of modules that came from a folder; where libraries lie there, too, only those of one package."""
    among_libraries = _is_library(root)
    for name, item in list(sys.modules.items()):
        first, file = name.partition(".")[0], getattr(item, "__file__", None)
        if file is None or (first != top and (among_libraries or first in PACKAGES)):
            continue
        path = Path(file).resolve()
        if path.is_relative_to(root) and (among_libraries or not _is_library(path)):
            yield path


def _is_library(path: Path) -> bool:
    """Whether something lies where Python and installed packages do; an environment may lie in the user's folder."""
    prefixes = (Path(prefix).resolve() for prefix in (sys.prefix, sys.base_prefix))
    return not LIBRARIES.isdisjoint(path.parts) or any(path.is_relative_to(prefix) for prefix in prefixes)

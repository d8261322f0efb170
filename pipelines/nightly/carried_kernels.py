"""Machine code of this checkout's detection for a copy of its files, as compiling it again takes half a minute.

Numba keeps machine code under a source file's path, so that a copy's is not found by itself. It is carried only where
the copy has the same sources; what is missing there, Numba compiles when it is called.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from numba.core import caching

from datasets.store.atomic import own_name
from pipelines.detection import kernel_cache

PLACE = Path("pipelines", "detection")  # in a checkout


def carry_kernels(checkout: Path) -> None:
    """Give a copy of a checkout what this checkout keeps of compiled functions, unless it has some of its own.

    It goes where the copy will look for it: beside the copy's sources, or where NUMBA_CACHE_DIR says.
    """
    package, own = checkout / PLACE, kernel_cache.choose_folder()
    if own is None or own.name != kernel_cache.PREFIX + kernel_cache.hash_of_sources(package):
        return
    place = place_of(checkout)
    if place is None:
        return
    temporary = place.with_name(own_name(".tmp-"))
    try:
        if not place.exists():
            shutil.copytree(_of_sources(own, kernel_cache.PACKAGE), temporary)
            temporary.rename(place)
    except OSError:  # there is nothing yet, the disk refuses, or another process was faster
        shutil.rmtree(temporary, ignore_errors=True)


def place_of(checkout: Path) -> Path | None:
    """Where a checkout's processes look for what was compiled of its detection; None where no place can be written."""
    package = checkout / PLACE
    folder = kernel_cache.choose_folder(package)
    return None if folder is None else _of_sources(folder, package)


def _of_sources(folder: Path, package: Path) -> Path:
    """Where Numba keeps in a folder what it compiles of a package's files."""
    locator: Any = caching._CacheLocator
    return folder / locator.get_suitable_cache_subpath(str(package / "__init__.py"))

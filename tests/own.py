"""A user's own module, for the tests of functions that are named package.module:function, and the rows it makes."""

from __future__ import annotations

import importlib
import itertools
import sys
import textwrap

import pyarrow.parquet as pq

_numbers = itertools.count()


def own_module(folder, patch, text):
    """Name of a new module in a folder that becomes the current one; nothing of it outlives the test."""
    name = f"own_module_{next(_numbers)}"
    (folder / f"{name}.py").write_text(textwrap.dedent(text))
    patch.chdir(folder)
    patch.setattr(sys, "path", sys.path[:])
    patch.delitem(sys.modules, name, raising=False)
    importlib.invalidate_caches()
    return name


def image_rows(root, table, name, camera="exact"):
    """The rows that a system which goes from image to pose has in a dataset's table."""
    paths = sorted((root / table).glob(f"{name.replace(':', '@')}-image-{camera}-all-0*"))
    return [row for path in paths for row in pq.read_table(path).to_pylist()]

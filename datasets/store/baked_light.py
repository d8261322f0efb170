"""The light of a world on its target, baked once for a dataset and kept in it as OpenEXR."""

from __future__ import annotations

import functools
import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import numpy as np

from datasets.plan import Frame
from datasets.recipe.model import Recipe
from datasets.store.atomic import local_copy
from datasets.store.exr_file import read_exr, read_header, write_exr
from datasets.url_path import UrlPath
from render.hybrid.bake import BakedLight
from render.hybrid.prepare import baked_light
from render.world import WorldDraw

try:
    import fcntl
except ImportError:  # a system without flock: workers that begin at once may each bake the light, to the same bits
    fcntl = None

FOLDER, FILE = "light", "baked.exr"
DECIDES = (  # of a world: what the light on the target depends on
    "surround", "file_sha256", "surface", "floor_mm", "room_mm", "turbidity", "mm_per_unit", "place", "facing", "up",
    "path_depth", "bake_samples",
)  # fmt: skip


def light_of(root: Path, recipe: Recipe, frame: Frame) -> BakedLight:
    """The dataset's baked light: read where it is there and made from the same things, else baked and kept.

    The first worker that needs it bakes it, the others wait. frame: any that has this light.

    Raises:
        ValueError: no light reaches the target, or the user's scene cannot be used.
        OSError: the disk or its permissions refuse.
    """
    return _light_of(root, recipe, frame.world)


@functools.lru_cache(maxsize=1)
def _light_of(root: Path, recipe: Recipe, draw: WorldDraw) -> BakedLight:
    path, key = root / FOLDER / FILE, light_key(recipe, draw)
    path.parent.mkdir(parents=True, exist_ok=True)
    with _alone(path.parent):
        found = _read(path, key)
        if found is None:
            found = baked_light(recipe.world, draw, recipe.target, recipe.light)
            _write(found, path, key)
    return found


def light_key(recipe: Recipe, draw: WorldDraw) -> str:
    """Hash of all that decides the baked light; how pictures are taken of it is not among it."""
    world, drawn = asdict(recipe.world), asdict(draw)
    del drawn["exposure"]
    parts = {
        "target": asdict(recipe.target),
        "light": asdict(recipe.light),
        "world": {name: world[name] for name in DECIDES},
        "draw": drawn,
        "mitsuba": version("mitsuba"),
    }
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _write(light: BakedLight, path: Path, key: str) -> None:
    header = {"key": key, "circle": json.dumps([float(value) for value in light.disc])}
    write_exr(path, header, {"RGB": light.board, "edges": light.edges})


def _read(path: Path, key: str) -> BakedLight | None:
    """The light in a file, None where there is none, or none of this key."""
    if not path.is_file():
        return None
    try:
        with local_copy(path) as here:
            if read_header(here).get("key") != key:
                return None
            header, channels = read_exr(here)
        board, edges = (np.asarray(channels[name], np.float32) for name in ("RGB", "edges"))
        return BakedLight(board, edges, np.array(json.loads(header["circle"]), np.float32))
    except (ValueError, LookupError, TypeError, OSError):
        return None  # damaged: it is baked again


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """One process at a time in the body, of those on this machine; in an object store each bakes to the same bits."""
    if isinstance(folder, UrlPath):
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        if fcntl is not None:
            with suppress(OSError):  # a file system without locks
                fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)

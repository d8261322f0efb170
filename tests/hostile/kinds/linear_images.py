"""OpenEXR files in a dataset's masters: right keys and digests, and pixels, windows and channels that are wrong."""

from __future__ import annotations

import random
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from datasets.store import exr_file
from datasets.store.exr_file import DIGEST, read_exr, silent_library
from tests.hostile.running import Call
from tests.hostile.values import any_number, damaged
from tests.wrong_input import Place


def make(rng: random.Random, place: Place) -> tuple[str, list[Call]]:
    """A dataset whose first linear image is hostile, developed again, reused and verified."""
    root = place.dataset()
    path = min((root / "masters").iterdir())
    what = rng.choice((_written, _written, _written, _bytes))(rng, path)
    calls: list[Call] = [("verify", root)] if rng.random() < 0.3 else []
    return what, [*calls, generated_from(rng, root, place)]


def generated_from(rng: random.Random, root: Path, place: Place, options: tuple[str, ...] = ()) -> Call:
    """The command that develops a dataset's linear images, into it or, with further options, into a new one."""
    recipe = root / "recipe.toml"
    if rng.random() < 0.5:
        for name in ("frames", "detections", "estimates", "scores"):
            shutil.rmtree(root / name)
        return ("generate", recipe, "--out", root, "-q")
    return ("generate", recipe, "--out", place.new(), "-q", "--reuse", root, "--regime", "harsh", *options)


def _written(rng: random.Random, path: Path) -> str:
    header, channels = read_exr(path)
    stated = {name: header[name] for name in ("dataWindow", "displayWindow", "key", "background")}
    name = "Y"
    pixels = np.array(channels[name])
    ways: dict[str, Any] = {
        "nan": lambda: pixels * np.float32(np.nan),
        "one nan": lambda: _with(pixels, np.nan),
        "infinite": lambda: _with(pixels, np.inf),
        "huge": lambda: pixels * np.float32(3e38),
        "negative": lambda: -pixels,
        "half": lambda: pixels.astype(np.float16),
        "whole": lambda: pixels.astype(np.uint32),
        "smaller": lambda: pixels[::2, ::2],
        "colour": lambda: np.repeat(pixels[..., None], 3, axis=2),
    }
    way = rng.choice(
        [*sorted(ways), "channels", "window", "window", "background", "no key", "tiles", "parts", "claims"]
    )
    if way in ways:
        pixels = np.ascontiguousarray(ways[way]())
        name = "RGB" if pixels.ndim == 3 else "Y"
        if way in ("smaller", "colour"):
            low = stated["dataWindow"][0]
            stated["dataWindow"] = (low, low + np.array(pixels.shape[1::-1], np.int32) - 1)
    if way == "channels":
        name = rng.choice(("Z", "y", "", "R", "x" * 300, "Y.left"))
    if way == "window":
        shift = rng.choice((-1, 1, 5, 10_000, -(2**30), 2**30))
        key = rng.choice(("dataWindow", "displayWindow"))
        stated[key] = tuple(np.asarray(corner + shift, np.int32) for corner in stated[key])
    if way == "background":
        stated["background"] = float(np.float32(any_number(rng))) if rng.random() < 0.7 else "white"
    if way == "no key":
        stated.pop(rng.choice(("key", "background")))
    _write(path, stated, {name: pixels}, way)
    return way


def _with(pixels: Any, value: float) -> Any:
    changed = pixels.copy()
    changed[0, 0] = value
    return changed


def _write(path: Path, stated: dict[str, Any], channels: dict[str, Any], way: str) -> None:
    """As our own writer does, with a digest that fits; what the library refuses is left as it was."""
    kind = OpenEXR.tiledimage if way == "tiles" else OpenEXR.scanlineimage
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": kind, **stated}
    try:
        header[DIGEST] = exr_file._digest(stated, channels)
    except (TypeError, ValueError):
        header[DIGEST] = "x"
    with silent_library():
        try:
            if way == "parts":
                parts = [OpenEXR.Part(dict(header), dict(channels), str(number)) for number in range(3)]
                OpenEXR.File(parts).write(str(path))
            else:
                OpenEXR.File(header, channels).write(str(path))
        except (RuntimeError, ValueError, TypeError):
            pass
    if way == "claims":
        data = bytearray(path.read_bytes())
        at = data.find(b"dataWindow\0box2i\0") + 21
        data[at + 8 : at + 16] = np.array([99_999, 99_999], "<i4").tobytes()
        path.write_bytes(bytes(data))


def _bytes(rng: random.Random, path: Path) -> str:
    if rng.random() < 0.15:
        path.unlink()
        path.symlink_to(rng.choice(("/dev/zero", "/etc/passwd", str(path))))
        return "a link"
    what, data = damaged(rng, path.read_bytes())
    path.write_bytes(data)
    return what

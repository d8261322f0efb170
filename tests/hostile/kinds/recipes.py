"""Recipes: wrong types and sizes of every key, nesting, text that is none, files that are none."""

from __future__ import annotations

import os
import random
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import tomlkit

from datasets.recipe.model import parse_recipe
from tests.hostile.running import Call
from tests.hostile.values import any_value, damaged, garbage
from tests.wrong_input import Place

KINDS_OF_TARGET = ("chessboard", "plain_chessboard", "charuco", "aprilgrid", "circles")


def make(rng: random.Random, place: Place) -> tuple[str, list[Call]]:
    """A recipe, described, drawn as a target or begun as a dataset."""
    what, path = rng.choice((_value, _value, _value, _value, _value, _text, _bytes, _file))(rng, place)
    call = rng.choice(
        (("describe", path), ("generate", path, "--out", place.new(), "-q"), ("target", path, "--out", "x.svg"))
    )
    return f"{what}; {call[0]}", [call]


def _value(rng: random.Random, place: Place) -> tuple[str, Path]:
    """One key, or two, of a full recipe with another value, or an unknown key."""
    recipe: dict[str, Any] = parse_recipe(place.text, "tiny").model_dump(mode="json")
    recipe["optics"].pop("focus_mm", None)
    recipe["cameras"][0].pop("max_field_deg", None)
    keys = [*_places(recipe)]
    told: list[str] = []
    for _ in range(rng.choice((1, 1, 2, 3))):
        *parents, last = rng.choice(keys)
        if rng.random() < 0.1:
            last = rng.choice(("", "x y", "__class__", "ünïcode", "a.b", "x" * 5000))
        found: Any = recipe
        try:
            for key in parents:
                found = found[key]
            found[last] = any_value(rng)
        except (KeyError, TypeError, IndexError):
            continue  # its parent has been replaced
        told.append(f"{'.'.join(map(str, parents))}.{last} = {str(found[last])[:40]!r}")
    return ", ".join(told), place.recipe(_toml(recipe))


def _places(data: Any, before: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    for key in data if isinstance(data, dict) else range(len(data)):
        yield (*before, key)
        if isinstance(data[key], dict | list):
            yield from _places(data[key], (*before, key))


def _toml(data: dict[str, Any]) -> str:
    """TOML of any data; what the library refuses is put in by hand."""
    try:
        return tomlkit.dumps(data)
    except (ValueError, TypeError, tomlkit.exceptions.TOMLKitError):
        return "\n".join(f"{key} = {value!r}" for key, value in data.items())


def _text(rng: random.Random, place: Place) -> tuple[str, Path]:
    big = 100_000_000
    deep = 100_000
    cases = {
        "100 MB name": lambda: place.text.replace("tiny", "x" * big),
        "100 MB comment": lambda: "#" * big + "\n" + place.text,
        "lists in lists": lambda: f"a = {'[' * deep}{']' * deep}\n{place.text}",
        "tables in tables": lambda: f"[{'.'.join('a' * 30000)}]\n",
        "inline tables": lambda: "a = " + "{b = " * 3000 + "1" + "}" * 3000,
        "many keys": lambda: "\n".join(f"k{i} = {i}" for i in range(200_000)),
        "many cameras": lambda: place.text + re.search(r"\[\[cameras.*", place.text, re.S)[0] * 3000,
        "huge number": lambda: place.text.replace("seed = 5", f"seed = {'9' * 5000}"),
        "huge exponent": lambda: place.text.replace("fx = 344.7", "fx = 1e999999999"),
        "million poses": lambda: place.text.replace("step = 90", "step = 1e-6"),
        "endless path": lambda: place.text.replace("stop = 90", "stop = 1e300"),
        "step zero": lambda: place.text.replace("step = 90", "step = 0"),
        "scatter of 1e9": lambda: _with_path(place.text, 'kind = "scatter"\ncount = 1000000000'),
        "scatter that fits nowhere": lambda: _with_path(
            place.text, 'kind = "scatter"\ncount = 5\ndepth_range_mm = [1, 2]'
        ),
        "field of 1e9": lambda: _with_path(place.text, 'kind = "field"\ncount = 1000000000'),
        "board of 1e6": lambda: place.text + "\n[target]\ncolumns = 1000000\nrows = 1000000\n",
        "board of 3000": lambda: place.text + "\n[target]\ncolumns = 3000\nrows = 3000\n",
        "camera of 1e9": lambda: place.text.replace("width = 400", "width = 1000000000"),
        "negative camera": lambda: place.text.replace("width = 400", "width = -400").replace("= 300", "= -300"),
        "scene file": lambda: place.text + '\n[world]\nsurround = "scene"\nfile = "/dev/zero"\n',
        "scene folder": lambda: place.text + '\n[world]\nsurround = "scene"\nfile = "/"\n',
        "target": lambda: _with_target(place.text, rng.choice(KINDS_OF_TARGET), rng.choice((0, 1, 2, 500, 10**6, -3))),
        "samples": lambda: place.text.replace("samples = 4", f"samples = {rng.choice((0, 3, 65537, -4))}"),
    }
    name = rng.choice(sorted(cases))
    return name, place.recipe(cases[name]())


def _with_target(text: str, pattern: str, columns: int) -> str:
    return f'{text}\n[target]\npattern = "{pattern}"\ncolumns = {columns}\n'


def _with_path(text: str, lines: str) -> str:
    return re.sub(r"\[trajectory\].*?\n\n", f"[trajectory]\n{lines}\n\n", text, flags=re.S)


def _bytes(rng: random.Random, place: Place) -> tuple[str, Path]:
    path = place.recipe()
    what, data = damaged(rng, place.text.encode())
    if rng.random() < 0.2:
        what, data = "random bytes", garbage(rng, rng.choice((0, 1, 100, 10_000)))
    path.write_bytes(data)
    return what, path


def _file(rng: random.Random, place: Place) -> tuple[str, Path]:
    path = place.folder / "recipe.toml"
    way = rng.choice(("folder", "pipe", "device", "missing", "loop", "socket name", "long name", "nul"))
    if way == "folder":
        path.mkdir()
    elif way == "pipe":
        os.mkfifo(path)
    elif way == "device":
        path.symlink_to(rng.choice(("/dev/zero", "/dev/tty", "/dev/random", "/proc/self/mem", "/dev/full")))
    elif way == "loop":
        path.symlink_to(path)
    elif way == "long name":
        path = place.folder / f"{'x' * 300}.toml"
    elif way == "nul":
        path = Path("a\0b.toml")
    elif way == "socket name":
        path = Path("\udcff\udc80.toml")
    return way, path

"""Command lines with values that no option takes, for every command."""

from __future__ import annotations

import random
from typing import Any

import click

from pipelines.cli import all_commands
from tests.hostile.running import Call
from tests.hostile.values import FLOATS, TEXTS, WHOLE
from tests.wrong_input import Place

# Commands that work for minutes where nothing is wrong are given something that is.
LONG = {"demo": "--out", "bench": "recipe", "paper": "--only", "nightly run": "suite", "doctor": ""}
SMALL = ("describe", "recipes", "verify", "report", "frame", "compare", "target", "repair")


def make(rng: random.Random, place: Place) -> tuple[str, list[Call]]:
    """One command with one or more wrong words."""
    root = place.dataset()
    recipe = place.recipe()
    commands = all_commands()
    name = rng.choice([key for key in sorted(commands) if key not in ("doctor",)])
    words: list[Any] = name.split()
    known: dict[str, list[Any]] = {
        "recipe": [recipe],
        "out": [place.folder / "out"],
        "folder": [root],
        "frame_id": [0],
        "first": [root],
        "second": [root],
        "history": [place.folder / "nights"],
    }
    parameters = commands[name].params
    wrong = set(rng.sample(range(len(parameters)), min(len(parameters), rng.choice((1, 1, 2, 3)))))
    for number, parameter in enumerate(parameters):
        given = [_value(rng)] if number in wrong else known.get(parameter.name or "", [])
        if name in LONG and parameter.name in ("recipe", "only", "suite"):
            given = [_value(rng)]
        for value in given:
            words += (
                [value]
                if isinstance(parameter, click.Argument) or not parameter.opts[0].startswith("-")
                else _option(parameter, value)
            )
    if name == "demo":
        words += ["--workers", rng.choice(("0", "x", "-1")), "--out", place.new()]
    if name in ("paper", "bench"):
        words += ["--only", "nothing"]
    if name == "nightly run":
        words += ["--workers", "0"]
    if rng.random() < 0.1:
        words.insert(rng.randrange(len(words)), rng.choice(TEXTS[:20]))
    return " ".join(str(word)[:60] for word in words).encode("unicode_escape").decode(), [tuple(words)]


def _option(parameter: Any, value: str) -> list[str]:
    if getattr(parameter, "is_flag", False):
        return [parameter.opts[0]]
    return [f"{parameter.opts[0]}={value}"] if parameter.opts[0].startswith("--") else [parameter.opts[0], value]


def _value(rng: random.Random) -> str:
    """A word; no process can be given a zero byte."""
    value = str(
        rng.choice(
            rng.choice((WHOLE, FLOATS, TEXTS, ("/dev/null/x", "/", ".", "..", "\udcff", "1/0", "a:b", "os:abort")))
        )
    )
    return value.replace("\0", "")[:100_000]

"""Values that nobody expects."""

from __future__ import annotations

import math
import random
from typing import Any

WHOLE = (0, -1, 1, 2, 7, 2**31 - 1, 2**31, 2**53 + 1, 2**63 - 1, 2**63, -(2**63), 10**30)
FLOATS = (0.0, -0.0, -1.0, 1e-320, 1e-30, 1e30, 1e150, 1e300, -1e308, math.inf, -math.inf, math.nan, 0.1, 3.5)
TEXTS = (
    "",
    " ",
    "\0",
    "nan",
    "../../outside/x",
    "/etc/passwd",
    "~",
    "-",
    "--help",
    "a\nb",
    "\u202e\u0000x",
    "\U0001f41f" * 40,
    "\ud7ff",
    "e\u0301",
    "\ufeff",
    "%s%n{0}",
    "<script>alert(1)</script>",
    "x" * 300,
    "CON",
    "a/b",
    "'; drop table",
    "x" * 100_000,
    "\u0661",
    "ok",
    "OK",
    "circle",
    "best",
    "none",
)
OTHERS = (True, False, [], {}, [[]], [0], [math.nan], {"a": 1}, [[[[[[0]]]]]], [1, "a", 2.0], ["x"] * 1000)


def any_value(rng: random.Random) -> Any:
    """A value of any type."""
    return rng.choice(rng.choice((WHOLE, FLOATS, TEXTS, OTHERS)))


def any_number(rng: random.Random) -> float:
    """A number that is wrong in most places."""
    return rng.choice(rng.choice((WHOLE, FLOATS)))


def garbage(rng: random.Random, count: int) -> bytes:
    """Random bytes."""
    return rng.randbytes(count)


def damaged(rng: random.Random, data: bytes) -> tuple[str, bytes]:
    """What was done to bytes, and the result."""
    way = rng.choice(("cut", "flip", "zero", "doubled", "inserted", "start"))
    at = rng.randrange(max(1, len(data)))
    if way == "cut":
        return f"cut at {at}", data[:at]
    if way == "flip":
        changed = bytearray(data)
        for _ in range(rng.choice((1, 3, 20))):
            changed[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        return "bits flipped", bytes(changed)
    if way == "zero":
        count = rng.choice((1, 16, 512))
        return f"{count} zeros at {at}", data[:at] + bytes(count) + data[at + count :]
    if way == "doubled":
        return "twice", data + data
    if way == "inserted":
        return f"noise at {at}", data[:at] + garbage(rng, 64) + data[at:]
    return "noise at the start", garbage(rng, 16) + data[16:]

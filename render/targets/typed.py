"""Types of a target's values, which the type checker sees and a caller from elsewhere may not."""

from __future__ import annotations

import math
import numbers
from dataclasses import fields
from typing import Any

from eposit.arrays import shown


def check_types(target: Any) -> None:
    """Refuse values that are not of the kind of their defaults: whole numbers, finite numbers, or so many of them.

    Raises:
        ValueError: with the value and what it must be.
    """
    for field in fields(target):
        value, default = getattr(target, field.name), field.default
        if isinstance(default, tuple):
            if not isinstance(value, tuple | list) or len(value) != len(default) or not all(map(_fits, value, default)):
                raise ValueError(f"target {field.name} is {shown(value)}; it must be {len(default)} numbers")
        elif not _fits(value, default):
            raise ValueError(f"target {field.name} is {shown(value)}; it must be {_name(default)}")


def _fits(value: object, default: object) -> bool:
    if isinstance(default, str):
        return isinstance(value, str)
    if isinstance(default, int):
        return isinstance(value, numbers.Integral)
    if isinstance(default, float):
        return isinstance(value, numbers.Real) and math.isfinite(value)
    return True


def _name(default: object) -> str:
    names = {str: "a text", int: "a whole number", float: "a finite number"}
    return names.get(type(default), "another value")

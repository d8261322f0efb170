"""TOML texts that are changed where they must be, with all that a person wrote around it."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from typing import Any

import tomlkit
from tomlkit import TOMLDocument
from tomlkit.exceptions import TOMLKitError


def changed_text(text: str, change: Callable[[TOMLDocument], str], wanted: dict[str, Any]) -> str | None:
    """What `change` writes from a TOML text, None if that is not TOML that means `wanted`."""
    try:
        changed = change(tomlkit.parse(text))
        return changed if tomllib.loads(changed) == wanted else None
    except (TOMLKitError, tomllib.TOMLDecodeError):
        return None

"""A recipe's text with other values, as if they had been written in the file."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, MutableMapping
from typing import Any

import tomlkit
from tomlkit import TOMLDocument

from datasets.errors import UserError
from datasets.recipe.toml_text import changed_text


def with_regime(text: str, regime: str, source: str) -> str:
    """The TOML text with `sensor.regime` set; everything else stays as it is, comments too.

    text: a recipe that can be read. source: names it in messages.

    Raises:
        UserError: the text is written so that the regime cannot be put into it.
    """
    data = tomllib.loads(text)
    wanted = data | {"sensor": data.get("sensor", {}) | {"regime": regime}}
    changed = changed_text(text, lambda document: _put_regime(document, regime), wanted)
    if changed is None:
        raise UserError(f"cannot put --regime into {source}; write regime = {json.dumps(regime)} under [sensor] there")
    return changed


def with_values(text: str, values: Mapping[tuple[str, ...], int], source: str) -> str:
    """The TOML text with other values of some keys, each given as its path; comments stay.

    Raises:
        UserError: the text is written so that a value cannot be put into it.
    """
    wanted = tomllib.loads(text)
    for path, value in values.items():
        _table(wanted, path)[path[-1]] = value
    changed = changed_text(text, lambda document: _put_values(document, values), wanted)
    if changed is None:
        raise UserError(f"cannot put {', '.join('.'.join(path) for path in values)} into {source}; write them there")
    return changed


def _put_values(document: TOMLDocument, values: Mapping[tuple[str, ...], int]) -> str:
    for path, value in values.items():
        _table(document, path)[path[-1]] = value
    return document.as_string()


def _table(document: MutableMapping[str, Any], path: tuple[str, ...]) -> MutableMapping[str, Any]:
    for name in path[:-1]:
        document = document.setdefault(name, {})
    return document


def _put_regime(document: TOMLDocument, regime: str) -> str:
    sensor = document.get("sensor")
    if isinstance(sensor, MutableMapping):
        sensor["regime"] = regime
        return document.as_string()
    return f"{document.as_string().rstrip()}\n\n{tomlkit.dumps({'sensor': {'regime': regime}})}"

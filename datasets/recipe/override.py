"""A recipe's text with another sensor regime, as if it had been written in the file."""

from __future__ import annotations

import json
import tomllib
from collections.abc import MutableMapping

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


def _put_regime(document: TOMLDocument, regime: str) -> str:
    sensor = document.get("sensor")
    if isinstance(sensor, MutableMapping):
        sensor["regime"] = regime
        return document.as_string()
    return f"{document.as_string().rstrip()}\n\n{tomlkit.dumps({'sensor': {'regime': regime}})}"

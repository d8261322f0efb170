"""A recipe's text with another sensor regime, as if it had been written in the file."""

from __future__ import annotations

import json
import re
import tomllib
from typing import Any

from datasets.errors import UserError

SECTION = re.compile(r"^[ \t]*\[[ \t]*sensor[ \t]*\][^\n]*\n?", re.MULTILINE)
NEXT_SECTION = re.compile(r"^[ \t]*\[", re.MULTILINE)
REGIME_LINE = re.compile(r"^[ \t]*regime[ \t]*=[^\n]*$", re.MULTILINE)


def with_regime(text: str, regime: str, source: str) -> str:
    """The TOML text with `sensor.regime` set; everything else stays as it is, other keys of the sensor too.

    Raises:
        UserError: the text is written so that no line can be put into it.
    """
    line = f"regime = {json.dumps(regime)}"
    header = SECTION.search(text)
    if header is None:
        changed = f"{text.rstrip()}\n\n[sensor]\n{line}\n"
    else:
        start = header.end()
        following = NEXT_SECTION.search(text, start)
        end = following.start() if following else len(text)
        body = text[start:end]
        body = REGIME_LINE.sub(line, body, count=1) if REGIME_LINE.search(body) else f"{line}\n{body}"
        changed = text[:start].rstrip("\n") + "\n" + body + text[end:]
    if _data(changed) != _wanted(text, regime):
        raise UserError(f"cannot put --regime into {source}; write regime = {json.dumps(regime)} under [sensor] there")
    return changed


def _wanted(text: str, regime: str) -> dict[str, Any] | None:
    data = _data(text)
    sensor = {} if data is None else data.get("sensor", {})
    return None if data is None or not isinstance(sensor, dict) else data | {"sensor": sensor | {"regime": regime}}


def _data(text: str) -> dict[str, Any] | None:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return None

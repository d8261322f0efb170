"""`baselines.toml`, beside the history: what the nights are compared with, and which failures somebody has accepted.

Nothing in the file is ever rewritten: `accept` adds an entry at its end, so comments and the order of the entries stay,
and the file tells who moved the baseline when and why. The last baseline of a recipe is the current one.
"""

from __future__ import annotations

import json
import tomllib
from dataclasses import asdict, dataclass, replace
from datetime import date
from pathlib import Path
from typing import Annotated

import tomlkit
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from tomlkit.items import InlineTable

from datasets.errors import UserError
from datasets.recipe.describe import sentence
from datasets.store.atomic import write_text
from datasets.store.lock import hold
from datasets.store.refusals import refused
from pipelines.nightly.accepted import Baseline, Waiver

FILE_NAME = "baselines.toml"
HEAD = "# What the nights are compared with, and accepted failures. The last baseline of a recipe is the current one.\n"


class _File(BaseModel):
    """What the file holds."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    baseline: Annotated[tuple[Baseline, ...], Field(description="baselines, the last accepted last")] = ()
    waiver: Annotated[tuple[Waiver, ...], Field(description="accepted failures")] = ()


@dataclass(frozen=True, slots=True)
class Baselines:
    """The file as it was read."""

    path: Path
    baselines: tuple[Baseline, ...]  # folders are absolute paths
    waivers: tuple[Waiver, ...]

    def current(self, recipe: str) -> Baseline:
        """The last baseline of a recipe. Checkouts of earlier ones may be gone.

        Raises:
            UserError: there is none, or its checkout does not exist.
        """
        own = [(number, item) for number, item in enumerate(self.baselines) if item.recipe == recipe]
        if not own:
            others = ", ".join(dict.fromkeys(item.recipe for item in self.baselines))
            held = f"only of {others}" if others else "none at all"
            raise UserError(f"{self.path} has no baseline of recipe {recipe!r}, {held}; accept a run of that recipe")
        number, found = own[-1]
        if found.checkout is not None and not found.checkout.is_dir():
            raise UserError(
                f"{self.path}: key 'baseline.{number}.checkout' is {found.checkout}, where no folder is; "
                f"check out {found.commit} there, or accept a new baseline"
            )
        return found

    def is_waived(self, gate: str, slice: str, what: str | int | None, today: date) -> bool:
        """Whether a failure of a metric or a frame in a slice has been accepted, and the waiver has not expired."""
        wanted = (gate, slice, what)
        return any((item.gate, item.slice, item.what) == wanted and item.holds(today) for item in self.waivers)

    def expired(self, today: date) -> list[str]:
        """A sentence for each waiver that no longer holds, unless a later one covers the same."""
        ended = [item for item in self.waivers if not item.holds(today)]
        return [
            f"the waiver of {_covered(item)} ended on {item.until}, and the gate judges it again ({item.reason})"
            for item in ended
            if not self.is_waived(item.gate, item.slice, item.what, today)
        ]


def load(path: Path) -> Baselines:
    """Read the file; one that is not there holds nothing.

    Raises:
        UserError: not TOML, a key that is unknown, missing or of the wrong type, or two baselines of one name.
    """
    return _parsed(path, _text(path))


def accept(path: Path, entry: Baseline | Waiver) -> Baselines:
    """Add a new baseline, or a waiver, at the end of the file; what is there stays byte for byte.

    A checkout that is not absolute lies beside the file.

    Raises:
        UserError: the file as it is, or with the entry, is wrong; then it does not change. The disk refuses.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise refused(path, error) from error
    with hold(path.parent):
        before = _text(path)
        _parsed(path, before)
        text = (before or HEAD) + ("\n" if not before or before.endswith("\n") else "\n\n") + _entry(entry)
        after = _parsed(path, text)
        write_text(path, text)
    return after


def _entry(entry: Baseline | Waiver) -> str:
    """The entry as TOML, keys without a value left out."""
    table = tomlkit.table()
    for key, value in asdict(entry).items():
        if value is not None and value != {}:
            table[key] = _inline(value) if isinstance(value, dict) else _plain(value)
    entries = tomlkit.aot()
    entries.append(table)
    return tomlkit.dumps({"baseline" if isinstance(entry, Baseline) else "waiver": entries})


def _inline(values: dict[str, object]) -> InlineTable:
    table = tomlkit.inline_table()
    table.update({key: _plain(value) for key, value in values.items()})
    return table


def _plain(value: object) -> object:
    return value.as_posix() if isinstance(value, Path) else value


def _covered(item: Waiver) -> str:
    what = "" if item.what is None else f"frame {item.what} in " if item.frame is not None else f"{item.what} in "
    return f"{what}{item.slice} at gate {item.gate}"


def _text(path: Path) -> str:
    try:
        return path.read_bytes().decode()
    except FileNotFoundError:
        return ""
    except UnicodeDecodeError:
        raise UserError(f"{path} is not UTF-8 text; save it as UTF-8") from None
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}; ask its owner for it") from None


def _parsed(path: Path, text: str) -> Baselines:
    try:
        held = _File.model_validate_json(json.dumps(tomllib.loads(text), default=str))
    except tomllib.TOMLDecodeError as error:
        raise UserError(f"{path} is not valid TOML: {error}; mend that line") from None
    except ValidationError as error:
        raise UserError(f"{path}: {sentence(error, _File)}") from None
    names = [item.name for item in held.baseline]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UserError(f"{path}: key 'baseline.name' is {twice!r} {names.count(twice)} times; give each its own name")
    folder = path.resolve().parent
    return Baselines(path, tuple(_placed(item, folder) for item in held.baseline), held.waiver)


def _placed(item: Baseline, folder: Path) -> Baseline:
    """A baseline whose folders are absolute."""
    checkout = None if item.checkout is None else folder / item.checkout
    return replace(item, checkout=checkout, systems={name: folder / own for name, own in item.systems.items()})

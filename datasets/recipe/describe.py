"""The keys of a recipe with their meanings, and faults in a recipe as sentences, from the fields that validate it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, asdict, fields, is_dataclass
from typing import Any, get_args, get_type_hints

from pydantic import BaseModel, ValidationError

from datasets.errors import did_you_mean
from datasets.recipe.camera_sets import FROM, camera_references, reference_of
from datasets.recipe.cameras import CameraSpec
from datasets.trajectories import TRAJECTORIES
from render.sensor.presets import DEFAULT_REGIME, SensorModel, regime_of, regimes
from render.targets.kinds import PATTERNS

Key = tuple[str, str, str]  # key, default, meaning
Place = tuple[int | str, ...]  # where a fault is, in Pydantic's form
REGIME = "sensor.regime"
CAMERAS_FROM = f"cameras.{FROM}"
OWN_VALUES = "own values"  # shown where values have no name
# What Pydantic calls these faults, and how the names of types begin that it puts between keys.
UNKNOWN_KEY = ("extra_forbidden", "unexpected_keyword_argument")
MISSING_KEY = ("missing", "missing_argument", "missing_keyword_only_argument")
KINDS: dict[str, Mapping[str, type]] = {"trajectory": TRAJECTORIES, "target": PATTERNS}  # of sections with several
TYPE_NAMES = ("tuple[", "literal[")


def keys_of(model: type[BaseModel]) -> Iterator[Key]:
    """Key, default and meaning of every key of a recipe's model."""
    for name, info in model.model_fields.items():
        sections = _sections(info.annotation)
        default = "required" if info.is_required() else toml_value(info.default)
        yield name, "section" if sections else default, info.description or ""
        if SensorModel in sections:
            choice = ", ".join(regimes())
            yield REGIME, toml_value(DEFAULT_REGIME), f"{choice}: the values of the keys below that are left out"
        if CameraSpec in sections:
            choice = ", ".join(camera_references())
            yield CAMERAS_FROM, toml_value(None), f"whose values the keys below have that are left out: {choice}"
        yield from ((f"{name}.{key}", default, meaning) for key, default, meaning in _merged(sections))


def _sections(hint: Any) -> list[type]:
    """The dataclasses that a key's values are, or are lists of; several where the section has several kinds."""
    return [kind for kind in (hint, *get_args(hint)) if isinstance(kind, type) and is_dataclass(kind)]


def _merged(sections: list[type]) -> Iterator[Key]:
    """Keys of a section; where it has several kinds, each key once, with the kinds that take it.

    Where kinds mean different things by a key, each meaning has its kinds before it, and the defaults stand in the same
    order.
    """
    found: dict[str, list[tuple[type, str, str]]] = {}
    for section in sections:
        for key, default, meaning in _section_keys(section):
            found.setdefault(key, []).append((section, default, meaning))
    for key, takers in found.items():
        meanings = list(dict.fromkeys(meaning for _, _, meaning in takers))
        defaults = [next(default for _, default, other in takers if other == meaning) for meaning in meanings]
        if len(takers) == len(sections) and len(meanings) == 1:
            yield key, defaults[0], meanings[0]
            continue
        kinds = [", ".join(_kind(section) for section, _, other in takers if other == meaning) for meaning in meanings]
        noted = "; ".join(f"{kind}: {meaning}" for kind, meaning in zip(kinds, meanings, strict=True))
        yield key, "; ".join(dict.fromkeys(defaults)), noted


def _kind(section: type) -> str:
    return next(name for kinds in KINDS.values() for name, kind in kinds.items() if kind is section)


def _section_keys(section: type) -> Iterator[Key]:
    hints = get_type_hints(section, include_extras=True)
    for field in fields(section):
        default = "required" if field.default is MISSING else toml_value(field.default)
        yield field.name, default, hints[field.name].__metadata__[0]
        for item in _item_types(hints[field.name]):
            yield from ((f"{field.name}.{key}", given, meaning) for key, given, meaning in _section_keys(item))


def _item_types(hint: Any) -> list[type]:
    """The dataclass whose values a list holds, of an annotated type; empty if it holds none."""
    return [kind for kind in get_args(get_args(hint)[0]) if is_dataclass(kind) and isinstance(kind, type)]


def toml_value(value: Any) -> str:
    """A value as TOML would write it."""
    if is_dataclass(value) and not isinstance(value, type):
        return json.dumps(asdict(value))
    return "none" if value is None else json.dumps(value)


def values_of(recipe: BaseModel) -> dict[str, str]:
    """Key to value for every key that a recipe takes; those of the cameras are lists over the cameras."""
    found = {key: _value_of(recipe, key) for key, _, _ in keys_of(type(recipe))}
    return {key: value for key, value in found.items() if value is not None}


def _value_of(recipe: BaseModel, key: str) -> str | None:
    """A key's value; None for a key of another kind of its section than the recipe's."""
    head, _, tail = key.partition(".")
    value = getattr(recipe, head)
    if key == REGIME:
        return toml_value(regime_of(value) or OWN_VALUES)
    if head == "cameras":
        return _shown_cameras(value, tail)
    if not tail:
        return "section" if is_dataclass(value) else toml_value(value)
    return _shown(value, tail) if tail.partition(".")[0] in field_names(type(value)) else None


def _shown_cameras(cameras: Sequence[CameraSpec], key: str) -> str:
    """What each camera has under a key; without one how many cameras there are."""
    if not key:
        return f"{len(cameras)} cameras"
    if key == FROM:
        return ", ".join(toml_value(reference_of(camera) or OWN_VALUES) for camera in cameras)
    return ", ".join(toml_value(getattr(camera, key)) for camera in cameras)


def _shown(section: Any, tail: str) -> str:
    """A section's value; of a list of tables how many there are, and of a key of theirs each one's."""
    name, _, inner = tail.partition(".")
    value = getattr(section, name)
    if inner:
        return ", ".join(toml_value(getattr(item, inner)) for item in value)
    tables = isinstance(value, tuple) and any(map(is_dataclass, value))
    return f"{len(value)} {name}" if tables else toml_value(value)


def field_names(section: type) -> list[str]:
    """Names of a section's keys."""
    return [field.name for field in fields(section)]


def sentence(error: ValidationError, model: type[BaseModel]) -> str:
    """The first fault of a validation as one sentence with the key's path."""
    # A misspelt key is missing under its right name as well: what is unknown comes first.
    first = min(error.errors(include_url=False), key=lambda fault: fault["type"] not in UNKNOWN_KEY)
    path, fault, message = _path(first["loc"]), first["type"], first["msg"]
    key = ".".join(path) or "recipe"
    if fault in UNKNOWN_KEY:
        return f"unknown key {key!r}{_known_instead(path, _section_at(first['loc']), model)}"
    if fault in MISSING_KEY:
        return f"key {key!r} is missing; add it"
    if fault == "value_error":
        return str(first.get("ctx", {}).get("error", message))
    given, why = _short(first.get("input")), message[:1].lower() + message[1:]
    return f"key {key!r} is {given} ({why}); it takes: {_meaning(path, model)}"


def _section_at(place: Place) -> type | None:
    """The kind of section that a place in a recipe lies in; Pydantic names it behind the section's key."""
    return KINDS[str(place[0])].get(str(place[1])) if len(place) > 1 and place[0] in KINDS else None


def _path(place: Place) -> list[str]:
    """The keys to a place as a recipe has them: without the types that Pydantic names between them."""
    parts = place[:1] + place[2:] if _section_at(place) else place
    return [str(part) for part in parts if not str(part).startswith(TYPE_NAMES)]


def _known_instead(path: list[str], section: type | None, model: type[BaseModel]) -> str:
    """What stands behind an unknown key: the one that may be meant, and all that are known there."""
    if section and len(path) == 2:
        known, where = field_names(section), f"known keys of kind {_kind(section)!r} are"
    else:
        known, where = _keys_beside(path, model), "known keys there are"
    return f"{did_you_mean(path[-1], known)}; {where} {', '.join(known)}"


def _meaning(path: list[str], model: type[BaseModel]) -> str:
    key = _without_numbers(path)
    return next((meaning for name, _, meaning in keys_of(model) if name == key), "")


def _keys_beside(path: list[str], model: type[BaseModel]) -> list[str]:
    section = _without_numbers(path[:-1])
    keys = [key.rpartition(".") for key, _, _ in keys_of(model)]
    return [name for prefix, _, name in keys if prefix == section]


def _without_numbers(path: list[str]) -> str:
    """A path as `keys_of` names it: without the places in lists."""
    return ".".join(part for part in path if not part.isdigit())


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."

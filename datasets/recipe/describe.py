"""The keys of a recipe with their meanings, and faults in a recipe as sentences, from the fields that validate it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import MISSING, asdict, fields, is_dataclass
from typing import Any, get_args, get_type_hints

from pydantic import BaseModel, ValidationError

from datasets.errors import did_you_mean
from datasets.recipe.camera_sets import FROM, camera_references, reference_of
from datasets.recipe.cameras import CameraSpec
from datasets.trajectories import TRAJECTORIES
from render.sensor.presets import DEFAULT_REGIME, SensorModel, regime_of, regimes

Key = tuple[str, str, str]  # key, default, meaning
REGIME = "sensor.regime"
CAMERAS_FROM = f"cameras.{FROM}"
OWN_VALUES = "own values"  # shown where values have no name
UNKNOWN_KEY = ("extra_forbidden", "unexpected_keyword_argument")  # Pydantic's types of fault


def keys_of(model: type[BaseModel]) -> Iterator[Key]:
    """Key, default and meaning of every key of a recipe's model."""
    for name, info in model.model_fields.items():
        sections = [kind for kind in (info.annotation, *get_args(info.annotation)) if isinstance(kind, type)]
        sections = [kind for kind in sections if is_dataclass(kind)]
        default = "required" if info.is_required() else toml_value(info.default)
        yield name, "section" if sections else default, info.description or ""
        if SensorModel in sections:
            choice = ", ".join(regimes())
            yield REGIME, toml_value(DEFAULT_REGIME), f"{choice}: the values of the keys below that are left out"
        if CameraSpec in sections:
            choice = ", ".join(camera_references())
            yield CAMERAS_FROM, toml_value(None), f"whose values the keys below have that are left out: {choice}"
        yield from ((f"{name}.{key}", default, meaning) for key, default, meaning in _merged(sections))


def _merged(sections: list[type]) -> Iterator[Key]:
    """Keys of a section; where it has several kinds, each key once, with the kinds that take it."""
    seen: set[str] = set()
    for section in sections:
        for key, default, meaning in _section_keys(section):
            takers = [other for other in sections if key.partition(".")[0] in field_names(other)]
            note = "" if len(takers) == len(sections) else f"{', '.join(map(_kind, takers))}: "
            if key not in seen:
                yield key, default, note + meaning
            seen.add(key)


def _kind(section: type) -> str:
    return next(name for name, kind in TRAJECTORIES.items() if kind is section)


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
    found: dict[str, str] = {}
    for key, _, _ in keys_of(type(recipe)):
        head, _, tail = key.partition(".")
        value = getattr(recipe, head)
        if key == REGIME:
            found[key] = toml_value(regime_of(value) or OWN_VALUES)
        elif key == CAMERAS_FROM:
            found[key] = ", ".join(toml_value(reference_of(camera) or OWN_VALUES) for camera in value)
        elif head == "cameras":
            shown = [toml_value(getattr(camera, tail)) for camera in value] if tail else [f"{len(value)} cameras"]
            found[key] = ", ".join(shown)
        elif not tail:
            found[key] = "section" if is_dataclass(value) else toml_value(value)
        elif tail.partition(".")[0] in field_names(type(value)):  # not a key of another kind of trajectory
            found[key] = _shown(value, tail)
    return found


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
    kind = TRAJECTORIES.get(str(first["loc"][1])) if first["loc"][:1] == ("trajectory",) and first["loc"][1:] else None
    parts = [part for i, part in enumerate(first["loc"]) if not (kind and i == 1)]
    path = [str(part) for part in parts if not (isinstance(part, str) and part.startswith(("tuple[", "literal[")))]
    key, fault, given = ".".join(path) or "recipe", first["type"], first.get("input")
    if fault in UNKNOWN_KEY:
        known = field_names(kind) if kind and len(path) == 2 else _keys_beside(path, model)
        where = f"known keys of kind {_kind(kind)!r} are" if kind and len(path) == 2 else "known keys there are"
        return f"unknown key {key!r}{did_you_mean(path[-1], known)}; {where} {', '.join(known)}"
    if fault in ("missing", "missing_argument", "missing_keyword_only_argument"):
        return f"key {key!r} is missing; add it"
    if fault == "value_error":
        return str(first.get("ctx", {}).get("error", first["msg"]))
    plain = ".".join(part for part in path if not part.isdigit())
    meaning = next((text for name, _, text in keys_of(model) if name == plain), "")
    return f"key {key!r} is {_short(given)} ({first['msg'][:1].lower()}{first['msg'][1:]}); it takes: {meaning}"


def _keys_beside(path: list[str], model: type[BaseModel]) -> list[str]:
    prefix = ".".join(part for part in path[:-1] if not part.isdigit())
    keys = [key for key, _, _ in keys_of(model)]
    return [key.rpartition(".")[2] for key in keys if key.rpartition(".")[0] == prefix]


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."

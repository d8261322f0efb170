"""Camera sets: cameras that come along, each written once, which any recipe takes by name."""

from __future__ import annotations

import tomllib
from importlib import resources
from typing import Any

from datasets.errors import UserError, did_you_mean
from datasets.recipe.cameras import CameraSpec

SETS = resources.files("datasets") / "recipes" / "cameras"
SUFFIX = ".toml"
FROM = "from"  # key of a recipe's camera that names where its other values come from

CameraValues = dict[str, Any]  # keys of a `CameraSpec`


def camera_references() -> dict[str, list[CameraValues]]:
    """What `from` takes: the name of a set, for all of its cameras in order, or `set.camera` for one of them."""
    found: dict[str, list[CameraValues]] = {}
    for path in sorted(SETS.iterdir(), key=lambda path: path.name.removesuffix(SUFFIX)):
        name, cameras = path.name.removesuffix(SUFFIX), _cameras(path.read_text(encoding="utf-8"))
        found[name] = cameras
        found |= {f"{name}.{camera['name']}": [camera] for camera in cameras}
    return found


def _cameras(text: str) -> list[CameraValues]:
    """The cameras of a set's file: one for each lens of each table, named after the lens."""
    return [
        {"name": lens, "lens": lens} | {key: value for key, value in table.items() if key != "lenses"}
        for table in tomllib.loads(text)["cameras"]
        for lens in table["lenses"]
    ]


def set_cameras(name: str) -> dict[str, CameraSpec]:
    """Camera name to camera, of the set of that name."""
    return {camera["name"]: CameraSpec(**camera) for camera in camera_references()[name]}


def camera_rows() -> list[tuple[str, CameraSpec]]:
    """`set.camera` and the camera, of every camera that comes along."""
    return [(name, CameraSpec(**found[0])) for name, found in camera_references().items() if "." in name]


def reference_of(camera: CameraSpec) -> str | None:
    """`set.camera` for a camera with the intrinsics of one that comes along, whatever its own name and limit are."""
    return next((name for name, other in camera_rows() if _intrinsics(other) == _intrinsics(camera)), None)


def _intrinsics(camera: CameraSpec) -> tuple[object, object]:
    return camera.true_camera(), camera.nominal_camera()


def names_cameras(entry: Any) -> bool:
    """Whether an entry of a recipe's `cameras` names a set or a set's camera."""
    return isinstance(entry, str) or (isinstance(entry, dict) and FROM in entry)


def camera_entries(cameras: Any) -> list[Any]:
    """The entries of a recipe's `cameras`: a name, or a list of names and tables. Anything else has none."""
    if isinstance(cameras, str):
        return [cameras]
    return cameras if isinstance(cameras, list) else []


def resolved(cameras: Any, source: str) -> Any:
    """A recipe's `cameras` with values instead of names of sets; what names none is left as it is.

    The keys of a table beside `from` replace the set's values. source: names the recipe in messages.

    Raises:
        UserError: an unknown name.
    """
    entries = camera_entries(cameras)
    if not any(map(names_cameras, entries)):
        return cameras
    return [camera for entry in entries for camera in entry_cameras(entry, source)]


def entry_cameras(entry: Any, source: str) -> list[Any]:
    """The cameras that one entry of a recipe's `cameras` stands for.

    Raises:
        UserError: an unknown name.
    """
    if not names_cameras(entry):
        return [entry]
    if isinstance(entry, str):
        return _named(entry, source)
    own = {key: value for key, value in entry.items() if key != FROM}
    return [camera | own for camera in _named(entry[FROM], source)]


def _named(reference: Any, source: str) -> list[CameraValues]:
    known = camera_references()
    if not isinstance(reference, str) or reference not in known:
        hint = did_you_mean(reference, known) if isinstance(reference, str) else ""
        raise UserError(f"{source}: unknown cameras {reference!r}{hint}; known ones are {', '.join(known)}")
    return known[reference]

"""The target as Mitsuba objects: its printed sheet as a mesh, and the raised circle if it has one."""

from __future__ import annotations

from typing import Any  # Any: Mitsuba describes a scene by dictionaries of mixed values

import numpy as np

from render import backend
from render.targets.chessboard import Chessboard
from render.targets.kinds import AnyTarget
from render.targets.mesh import Mesh, board_mesh

MATT: dict[str, Any] = {"type": "diffuse"}
# Under which key a surface takes the colour of the print.
REFLECTANCE_KEYS = {
    "diffuse": "reflectance",
    "plastic": "diffuse_reflectance",
    "roughplastic": "diffuse_reflectance",
    "principled": "base_color",
}


def target_objects(target: AnyTarget, surface: dict[str, Any] = MATT) -> dict[str, Any]:
    """Objects for a scene whose world frame is the target's: "board", and "circle" where the target has one.

    surface: a BSDF for the board without its reflectance, which is filled in: the print's. It may be nested, as in
    `bumpmap`; the innermost that takes a reflectance gets it. The circle is matt.

    Raises:
        ValueError: no BSDF in it that takes a reflectance.
        BackendError: Mitsuba cannot run here.
    """
    mesh = board_mesh(target)
    objects: dict[str, Any] = {"board": _mesh_object(mesh, _printed(surface, _texture(mesh)))}
    return objects | ({"circle": _circle(target)} if isinstance(target, Chessboard) else {})


def _printed(surface: dict[str, Any], texture: dict[str, Any]) -> dict[str, Any]:
    """The surface with the print's reflectance."""
    key = REFLECTANCE_KEYS.get(surface.get("type", ""))
    if key:
        return surface | {key: texture}
    for name, part in surface.items():
        if isinstance(part, dict) and _takes_reflectance(part):
            return surface | {name: _printed(part, texture)}
    raise ValueError(
        f"surface {surface.get('type')!r} takes no print; use one of {', '.join(REFLECTANCE_KEYS)}, which may be nested"
    )


def _takes_reflectance(surface: dict[str, Any]) -> bool:
    inner = [part for part in surface.values() if isinstance(part, dict)]
    return surface.get("type") in REFLECTANCE_KEYS or any(map(_takes_reflectance, inner))


def _texture(mesh: Mesh) -> dict[str, Any]:
    mi = backend.load()
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(mesh.reflectance[..., None]),
        "raw": True,
        "filter_type": "nearest",
        "wrap_mode": "clamp",
    }


def _mesh_object(mesh: Mesh, bsdf: dict[str, Any]) -> Any:
    """Mitsuba's mesh. A mesh that is made from arrays takes its BSDF as an object, in its properties."""
    mi = backend.load()
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf)
    made = mi.Mesh(
        "board",
        vertex_count=len(mesh.vertices),
        face_count=len(mesh.faces),
        has_vertex_normals=True,
        has_vertex_texcoords=True,
        props=properties,
    )
    parameters = mi.traverse(made)
    for name, values in (("positions", mesh.vertices), ("normals", mesh.normals), ("texcoords", mesh.uv)):
        parameters[f"vertex_{name}"] = mi.Float(values.astype(np.float32).ravel())
    parameters["faces"] = mi.UInt32(mesh.faces.astype(np.uint32).ravel())
    parameters.update()
    return made


def _circle(target: Chessboard) -> dict[str, Any]:
    transform = backend.load().ScalarTransform4f
    radius = target.circle_radius_mm
    return {
        "type": "disk",
        "flip_normals": True,
        "to_world": transform().translate(list(target.circle_centre)) @ transform().scale([radius, radius, 1.0]),
        "bsdf": {"type": "diffuse", "reflectance": {"type": "uniform", "value": target.circle}},
    }

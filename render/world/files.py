"""What decides the files of a world: a hash over an environment map, or over a scene and all that it reads."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from render.world.scene_file import SceneFileError, read_file, read_scene_file

SCENE_SUFFIX = ".xml"
MOST_BYTES = 1 << 30  # of an environment map, or of any file that a scene reads


def file_digest(path: Path) -> str:
    """SHA-256 of an environment map's bytes; of a scene over the names and bytes of every file that it reads.

    Names are from the scene's folder, so that a folder can move.

    Raises:
        SceneFileError: a file cannot be read, or the scene cannot be used.
    """
    scene = path.suffix.lower() == SCENE_SUFFIX
    total = hashlib.sha256()
    for part in read_scene_file(path).files if scene else (path,):
        data = read_file(part, MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            raise SceneFileError(f"{part} has more than {MOST_BYTES >> 20} MiB; give a smaller file")
        name = os.path.relpath(part, path.resolve().parent) if scene else ""
        total.update(f"{name}:{len(data)};".encode() + data)
    return total.hexdigest()


def require_unchanged(path: Path, sha256: str) -> None:
    """Refuse a file that is another one than when the recipe was read. sha256: empty for any.

    Raises:
        SceneFileError: it, or a file that it reads, has changed or cannot be read.
    """
    if sha256 and file_digest(path) != sha256:
        raise SceneFileError(
            f"{path} or a file that it reads is not the one that world file_sha256 states; put the old one back, or "
            "make a new dataset"
        )

"""What was found, kept for each kind and detector, so that a run goes on where it stopped.

A result holds as long as the sources that made it are the same: the drawing's, and for our detection its own.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import cv2

from tests.stress.answers import OURS

ROOT = Path(__file__).resolve().parents[2]
DRAWING = ("lenses", "boards", "scenes", "drawing", "views", "kind", "cameras", "surroundings", "answers", "measures")
DETECTION = ("pipelines/detection", "render/targets")


def sources(kind, detector):
    """A name for what a result depends on."""
    digest = hashlib.sha256(repr((kind.says, cv2.__version__)).encode())
    paths = [Path(__file__).with_name(f"{name}.py") for name in DRAWING]
    if detector == OURS:
        paths += [path for folder in DETECTION for path in sorted((ROOT / folder).rglob("*.py"))]
    for path in paths:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


class Results:
    """Rows of views in a folder."""

    def __init__(self, folder):
        self.folder = Path(folder)

    def rows(self, kind, detector):
        """Rows by view that still hold."""
        path = self._path(kind, detector)
        if not path.is_file():
            return {}
        kept = json.loads(path.read_text())
        return {int(view): row for view, row in kept["rows"].items()} if kept["made"] == sources(kind, detector) else {}

    def keep(self, kind, detector, rows):
        """Write them, at once or not at all."""
        path = self._path(kind, detector)
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part")
        part.write_text(json.dumps({"made": sources(kind, detector), "rows": rows}))
        part.replace(path)

    def _path(self, kind, detector):
        return self.folder / detector / f"{kind.name}.json"

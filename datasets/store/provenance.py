"""The environment that makes shards. The upper layer fills it in."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Provenance:
    """Program, libraries and machine."""

    commit: str  # of this project, with a note if files were changed since
    date: str  # YYYY-MM-DD
    python: str
    libraries: tuple[tuple[str, str], ...]  # name and version
    processor: str
    blas: str  # library, version and kernel that it chose for this processor

    def entry(self) -> dict[str, Any]:
        """As JSON has it."""
        return asdict(self) | {"libraries": dict(self.libraries)}

"""A recipe's target: which kinds there are, and what of one decides a dataset's content."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from render.targets.chessboard import Chessboard
from render.targets.kinds import AnyTarget

DEFAULT_PATTERN = "chessboard"


def target_values(target: AnyTarget) -> dict[str, Any]:
    """All that decides a target, for hashes.

    Without the pattern's name for the chessboard with a circle: it was the only kind once, and datasets from then are
    the same as those of today.
    """
    values = asdict(target)
    if isinstance(target, Chessboard):
        del values["pattern"]
    return values

"""What can be wrong with a file of a dataset, as `verify` tells it and `repair` mends it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from datasets.store.refusals import stage_of


class Kind(StrEnum):
    """What is wrong."""

    MISSING = "missing"  # it must be there and is not
    DAMAGED = "damaged"  # it does not hold what was written
    FOREIGN = "foreign"  # it belongs to another recipe, frame or place
    UNPLANNED = "unplanned"  # no file of this dataset has that name, and other programs would read it with the rest
    CHANGED = "changed"  # it is sound and not what the manifest says


@dataclass(frozen=True, slots=True)
class Problem:
    """One file that is not as it must be."""

    path: Path
    kind: Kind
    text: str  # one sentence with the remedy


def missing_file(path: Path) -> Problem:
    """A file that must be there."""
    return Problem(path, Kind.MISSING, f"{path} is missing; run the {stage_of(path)} stage to make it")


def damaged_file(path: Path, root: Path, what: str) -> Problem:
    """A file that does not hold what was written; what: how that shows."""
    return Problem(path, Kind.DAMAGED, f"{path} is damaged: {what}; `repair {root}` makes it again")


def unplanned_file(path: Path, root: Path) -> Problem:
    """A file that is none of the dataset's, among them."""
    text = f"{path} is no file of this dataset, and other programs read it with the rest; `repair {root}` puts it aside"
    return Problem(path, Kind.UNPLANNED, text)

"""Files that are put aside: nothing that was there is lost, also where it is replaced."""

from __future__ import annotations

import itertools
from pathlib import Path

from datasets.store.refusals import refused

QUARANTINE = "quarantine"  # the folder, with the dataset's folders in it
FAILED = "failed"  # in it the folder of reasons why shards could not be made


def put_aside(root: Path, path: Path) -> Path:
    """Move a file of a dataset into its quarantine, under its own name or with a number behind it; its new place.

    Raises:
        UserError: the disk or its permissions refuse.
    """
    wanted = root / QUARANTINE / path.relative_to(root)
    names = itertools.chain([wanted.name], (f"{wanted.name}.{number}" for number in itertools.count(1)))
    place = next(other for other in map(wanted.with_name, names) if not other.exists())
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        path.rename(place)
    except OSError as error:
        raise refused(place, error) from error
    return place

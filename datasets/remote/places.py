"""Which files of a folder are a dataset's, and in which order they are transferred."""

from __future__ import annotations

import re
from collections.abc import Iterable

from datasets.schema import TABLES
from datasets.store.baked_light import FILE, FOLDER
from datasets.store.dataset import CARD_FILE
from datasets.store.kept_masters import NOT_KEPT, PACKED
from datasets.store.linear_images import MASTERS
from datasets.store.manifest import MANIFEST_FILE
from datasets.store.pixel_truth import TRUTH
from datasets.store.refusals import RECIPE_FILE, SHARD_NAME

REPORT_FILE = "report.html"
IMAGE_NAME, ARCHIVE_NAME = re.compile(r"[0-9]{6,12}\.exr"), re.compile(r"[0-9]{6,12}-[0-9]{6,12}\.zip")
DERIVED = (CARD_FILE, REPORT_FILE, MANIFEST_FILE)  # made again from the shards at any time, so they may be replaced
EARLY = (RECIPE_FILE, NOT_KEPT, PACKED)  # what the rest is made by
ALONE = (*EARLY, f"{FOLDER}/{FILE}", *DERIVED)


def is_of_dataset(place: str) -> bool:
    """Whether a path relative to the dataset's folder is one that a dataset can have."""
    folder, _, name = place.partition("/")
    if place in ALONE:
        return True
    if folder in TABLES:
        return SHARD_NAME.fullmatch(name) is not None and "/" not in name
    if folder == MASTERS and ARCHIVE_NAME.fullmatch(name):
        return True
    return folder in (MASTERS, TRUTH) and IMAGE_NAME.fullmatch(name) is not None


def in_order(places: Iterable[str]) -> list[str]:
    """The recipe and how masters are kept first, what is made from the rest last: who finds a manifest finds it all."""
    late = dict.fromkeys(DERIVED, 1) | {MANIFEST_FILE: 2}
    return sorted(places, key=lambda place: (place != RECIPE_FILE, place not in EARLY, late.get(place, 0), place))

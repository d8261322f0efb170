"""Which shards a process does, where several share the work on one dataset."""

from __future__ import annotations

import re
from dataclasses import dataclass

from datasets.errors import UserError

MAX_PARTS = 100_000
FORM = re.compile(r"([0-9]{1,6})/([0-9]{1,6})")


@dataclass(frozen=True, slots=True)
class Part:
    """One of `count` parts of a dataset's shards; a shard and what is made from it are in one part."""

    number: int = 1  # from 1 to `count`
    count: int = 1

    @property
    def is_whole(self) -> bool:
        """Whether it is everything."""
        return self.count == 1

    def indices(self, shards: int) -> range:
        """The part's shards of so many: every `count`-th, so that parts are equal even where shards get harder."""
        return range(self.number - 1, shards, self.count)


WHOLE = Part()


def part_of(text: str | None) -> Part:
    """The part that `--shard I/N` means; everything without it.

    Raises:
        UserError: another form, or numbers out of range.
    """
    if text is None:
        return WHOLE
    found = FORM.fullmatch(text)
    part = Part(int(found[1]), int(found[2])) if found else None
    if part is None or not 1 <= part.number <= part.count <= MAX_PARTS:
        raise UserError(
            f"shard {text!r} is not usable; give --shard I/N with I from 1 to N and N at most {MAX_PARTS}, as 1/4"
        )
    return part

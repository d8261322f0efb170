"""What is other tonight than in the baseline's run: the reason for numbers that changed without a fault."""

from __future__ import annotations

from collections.abc import Mapping, Sequence


def other_machine(old: Mapping[str, str], new: Mapping[str, str]) -> tuple[str, ...]:
    """A phrase for each version, processor or BLAS kernel that is not the baseline's. old, new: names to values."""
    return tuple(
        f"{name} is {value} instead of {old.get(name, 'unknown')}"
        for name, value in new.items()
        if old.get(name) != value
    )


def other_code(old: str | None, new: str) -> tuple[str, ...]:
    """A phrase if the code, told by its digest, is not the baseline's."""
    return ("the code is not the baseline's",) if old != new else ()


def told(reasons: Sequence[str]) -> str:
    """The end of a sentence that names them."""
    return f"; {'; '.join(reasons)}" if reasons else "; code, versions and machine are the baseline's"

"""What every part of the reproduction hands to its page: tables, figures and claims."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum


class Verdict(StrEnum):
    """Whether a claim of the paper holds."""

    HOLDS = "holds"
    PARTLY = "partly"
    FAILS = "does not hold"


def held(condition: bool, otherwise: Verdict = Verdict.FAILS) -> Verdict:
    """The verdict that a measured condition gives."""
    return Verdict.HOLDS if condition else otherwise


@dataclass(frozen=True, slots=True)
class Claim:
    """One claim of the paper beside what we measure."""

    section: str  # of the paper
    text: str  # what the paper says, in our words
    paper: str  # its number
    equations: str  # ours under the paper's equations (`eposit`), with its interval where it is a score
    released: str  # ours under the released code's behaviour (`released`)
    verdict: Verdict
    why: str
    part: str  # of `python -m pipelines paper --only PART`, which measures it


@dataclass(frozen=True, slots=True)
class Table:
    """A table of texts."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


@dataclass(frozen=True, slots=True)
class Drawing:
    """A figure as one SVG text."""

    title: str
    svg: str
    note: str = ""


@dataclass(frozen=True, slots=True)
class Section:
    """What one part found."""

    title: str
    intro: str
    items: tuple[Table | Drawing, ...]
    claims: tuple[Claim, ...] = field(default=())

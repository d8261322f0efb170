"""The paper's claims: what it says as a table of statements, and each statement beside what we measure."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Generic, TypeVar

from pipelines.pages.sections import Section

Measured = TypeVar("Measured")
EQUATIONS, RELEASED = "equations", "released"  # the paper's equations, and its released code's behaviour


class Verdict(StrEnum):
    """Whether a claim of the paper holds."""

    HOLDS = "holds"
    PARTLY = "partly"
    FAILS = "does not hold"


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
class Statement(Generic[Measured]):
    """An entry of a table of claims: fields as a `Claim`'s, each a fixed text or a function of what was measured."""

    section: str
    text: str
    paper: str
    equations: Callable[[Measured], str] | str
    released: Callable[[Measured], str] | str
    verdict: Callable[[Measured], Verdict]
    why: Callable[[Measured], str] | str
    part: str

    def judged(self, measured: Measured) -> Claim:
        """The claim with its figures and its verdict."""
        equations, released, why = (
            told if isinstance(told, str) else told(measured) for told in (self.equations, self.released, self.why)
        )
        verdict = self.verdict(measured)
        return Claim(self.section, self.text, self.paper, equations, released, verdict, why, self.part)


@dataclass(frozen=True, slots=True)
class PaperSection(Section):
    """A section with the claims that it judges."""

    claims: tuple[Claim, ...] = ()


def judged(statements: Iterable[Statement[Measured]], measured: Measured) -> tuple[Claim, ...]:
    """The claims of a table."""
    return tuple(statement.judged(measured) for statement in statements)


def holds_if(
    condition: Callable[[Measured], bool], otherwise: Verdict = Verdict.FAILS
) -> Callable[[Measured], Verdict]:
    """The rule that a claim holds where a measured condition does."""
    return lambda measured: Verdict.HOLDS if condition(measured) else otherwise


def by_both(figure: Callable[..., str], *details: object) -> tuple[Callable[..., str], Callable[..., str]]:
    """The figures by the equations and as released, of a function of what was measured, the method and details."""

    def of(method: str) -> Callable[..., str]:
        return lambda measured: figure(measured, method, *details)

    return of(EQUATIONS), of(RELEASED)

"""What somebody has accepted: code as the baseline of the nights, or a failure that shall not fail the night again."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

NOT_EMPTY = Field(min_length=1)
DIGEST = r"[0-9a-f]{64}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Baseline:
    """Code and measures that the nights of a recipe are compared with.

    Raises:
        ValueError: not exactly one of `checkout` and `version`, or one of `measures` is no digest.
    """

    name: Annotated[str, "its name, which no other baseline has", Field(pattern=r"^[A-Za-z0-9_.-]{1,64}$")]
    recipe: Annotated[str, "recipe of the suites that it was measured on", NOT_EMPTY]
    checkout: Annotated[Path | None, "folder of the baseline's code, beside this file if it is not absolute"] = None
    version: Annotated[str | None, "installed version of `eposit`, instead of a checkout", NOT_EMPTY] = None
    commit: Annotated[str, "commit of the baseline's code", NOT_EMPTY]
    pinned_data: Annotated[str, "content hash of the pinned suite, 64 hexadecimal digits", Field(pattern=f"^{DIGEST}$")]
    run: Annotated[str, "run of the history that was accepted", NOT_EMPTY]
    measures: Annotated[dict[str, str], "suite to the digest of its table of measures in the history"]
    accepted_by: Annotated[str, "who accepted it", NOT_EMPTY]
    accepted_on: Annotated[date, "when, as 2026-05-04"]
    reason: Annotated[str, "why", NOT_EMPTY]
    systems: Annotated[
        dict[str, Path],
        "a user's functions, each with the folder of its code, frozen or installed, beside this file if not absolute",
    ] = field(default_factory=dict[str, Path])

    def __post_init__(self) -> None:
        if (self.checkout is None) == (self.version is None):
            given = "neither" if self.checkout is None else "both"
            raise ValueError(f"baseline {self.name!r} has {given} of the keys 'checkout' and 'version'; give one")
        for suite, digest in self.measures.items():
            if not re.fullmatch(DIGEST, digest):
                raise ValueError(
                    f"baseline {self.name!r}: key 'measures.{suite}' is {digest!r}, no 64 hexadecimal digits; "
                    "copy it from the history, or accept the run again"
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class Waiver:
    """A failure that somebody has accepted. It covers one metric or one frame; of gate `speed` a whole stage.

    Raises:
        ValueError: `metric` or `frame` is missing, or there where the gate has none.
    """

    gate: Annotated[Literal["accuracy", "fresh", "failures", "tail", "speed"], "gate that failed"]
    slice: Annotated[str, "slice as the gate names it; of gate `speed` the stage", NOT_EMPTY]
    metric: Annotated[str | None, "metric, of gates `accuracy`, `fresh` and `tail`", NOT_EMPTY] = None
    frame: Annotated[int | None, "frame_id, of gate `failures`"] = None
    reason: Annotated[str, "why", NOT_EMPTY]
    by: Annotated[str, "who accepted it", NOT_EMPTY]
    until: Annotated[date | None, "last day on which it holds, as 2026-05-04; for good if left out"] = None
    run: Annotated[str, "run whose failure it accepts", NOT_EMPTY]

    def __post_init__(self) -> None:
        wanted = {"failures": "frame", "speed": None}.get(self.gate, "metric")
        given = [key for key in ("metric", "frame") if getattr(self, key) is not None]
        if given != ([wanted] if wanted else []):
            found = f"has {' and '.join(map(repr, given))}" if given else "has neither 'metric' nor 'frame'"
            raise ValueError(f"waiver of gate {self.gate!r} {found}; give {f'{wanted!r} alone' if wanted else 'none'}")

    @property
    def what(self) -> str | int | None:
        """The metric or the frame that it covers."""
        return self.metric if self.frame is None else self.frame

    def holds(self, today: date) -> bool:
        """Whether it has not expired."""
        return self.until is None or today <= self.until

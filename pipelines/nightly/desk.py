"""What a night is asked, and what its steps work with."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from datasets.errors import UserError
from pipelines.engines.local import LocalEngine
from pipelines.nightly.accepted import Baseline
from pipelines.nightly.baselines import Baselines
from pipelines.nightly.history import History
from pipelines.nightly.other_code import Code
from pipelines.nightly.reading import Frozen, Here
from pipelines.nightly.systems import Systems


@dataclass(frozen=True, slots=True)
class Request:
    """What is asked of a night."""

    recipe: str
    history: Path
    regimes: tuple[str, ...]
    seed: int  # of the fresh pictures
    systems: Systems
    workers: int = 1
    without: tuple[str, ...] = ()  # gates that are left out


@dataclass(frozen=True, slots=True)
class Desk:
    """What the steps of a night work with."""

    request: Request
    history: History
    work: Path
    baselines: Baselines
    here: Here

    @property
    def engine(self) -> LocalEngine:
        """Where stages run."""
        return self.here.engine

    @property
    def console(self) -> Console:
        """What stages print to."""
        return self.here.console

    def frozen(self, baseline: Baseline) -> Frozen:
        """The baseline's code, and its copies of tonight's functions.

        Raises:
            UserError: a folder that the baseline names is not there.
        """
        copies = {
            item: baseline.systems[item.name]
            for item in self.request.systems.functions
            if item.name in baseline.systems
        }
        for item, folder in copies.items():
            if not folder.is_dir():
                told = f"baseline {baseline.name} has its code of {item.name} in {folder}, where no folder is"
                raise UserError(f"{told}; restore it, or accept a new baseline")
        return Frozen(code_of(baseline, self.request.history), copies, self.request.workers)

    def waived(self, gate: str, place: str, what: str | int | None) -> bool:
        """Whether somebody has accepted it."""
        return self.baselines.is_waived(gate, place, what, datetime.date.today())


def code_of(baseline: Baseline, history: Path) -> Code:
    """The baseline's code.

    Raises:
        UserError: it names an installed version whose folder is not there.
    """
    if baseline.checkout is not None:
        return Code(baseline.checkout)
    folder = history / "code" / f"eposit-{baseline.version}"
    if not folder.is_dir():
        wanted = f"pip install --no-deps --target {folder} eposit=={baseline.version}"
        raise UserError(f"baseline {baseline.name} is version {baseline.version} of eposit, not in {folder}; {wanted}")
    return Code(folder, ("eposit",))

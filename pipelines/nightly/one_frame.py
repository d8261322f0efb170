"""One picture of a run made again, from the run's recipe and seed, and what this code finds in it."""

from __future__ import annotations

from pathlib import Path

from datasets.errors import UserError, did_you_mean
from pipelines.nightly import suites
from pipelines.nightly.history import History
from pipelines.stages import one_frame
from pipelines.stages.one_frame import Remade

KINDS = (suites.PINNED, suites.FRESH, suites.CONFIRMING)


def remake(root: Path, run: str, suite: str, frame_id: int) -> Remade:
    """Make a picture of a run again and detect its points.

    suite: as the run's data name it, for example `fresh-typical`.

    Raises:
        UserError: no such run, suite or frame, or the recipe is gone.
    """
    row = History(root).run(run)
    known = {item["name"]: item["value"] for item in row["data"]}
    names = [name for name in known if name.partition("-")[0] in KINDS and "-" in name]
    if suite not in names:
        told = ", ".join(names) or "none"
        raise UserError(f"run {row['run_id']} has no suite {suite!r}{did_you_mean(suite, names)}; it has {told}")
    kind, _, regime = suite.partition("-")
    (made,) = suites.suites(kind, row["recipe"], [regime], suites.seed_of(kind, known))
    return one_frame.remake(made.recipe, frame_id, f"suite {suite}")

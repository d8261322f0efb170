"""Draw the pictures of a kind, ask the detectors, keep what they say."""

from __future__ import annotations

from tests.stress.answers import DETECTORS
from tests.stress.children import Child
from tests.stress.kinds import KINDS
from tests.stress.measures import measured
from tests.stress.sheet import keep_tile

SHOWN = 0  # view on the sheet


def children(detectors=DETECTORS):
    """A process for each detector, started when it is asked first."""
    easy = KINDS["plain-noise"]
    shot = easy.shot(0)
    return {detector: Child(detector, (shot.image, easy.target)) for detector in detectors}


def run_kind(kind, views, asked, results):
    """Rows of all detectors by view, those that hold and those that are made now.

    Any whole number is a view. What was kept of others stays.
    """
    found = {detector: results.rows(kind, detector) for detector in asked}
    for view in views:
        missing = [detector for detector in asked if view not in found[detector]]
        if not missing:
            continue
        shot = kind.shot(view)
        if view == SHOWN:
            keep_tile(kind, shot, results.folder / "tiles")
        for detector in missing:
            answer, seconds = asked[detector].ask(shot.image, kind.target)
            found[detector][view] = measured(kind, detector, shot, answer, seconds)
            results.keep(kind, detector, found[detector])
    return {detector: {view: rows[view] for view in views} for detector, rows in found.items()}

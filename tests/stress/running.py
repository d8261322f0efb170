"""Draw the pictures of a kind, ask the detectors, keep what they say."""

from __future__ import annotations

from tests.stress.answers import DETECTORS, OURS
from tests.stress.children import Child
from tests.stress.kinds import KINDS
from tests.stress.measures import measured
from tests.stress.sheet import keep_tile

SHOWN = 0  # view on the sheet
OWN_TIMES = 2  # as many views for ours: 40 circles tell a norm to 8 %, and OpenCV's detectors take hours for 20 views
USUAL = 20  # views; kinds that have fewer are of pictures that take a minute to draw


def children(detectors=DETECTORS):
    """A process for each detector, started when it is asked first."""
    easy = KINDS["plain-noise"]
    shot = easy.shot(0)
    return {detector: Child(detector, (shot.image, easy.target)) for detector in detectors}


def views_of(kind, detector, first=0, count=20):
    """The views that a detector is asked for, where OpenCV's are asked for so many, or for as many as there are."""
    most = min(count, kind.views)
    return range(first, first + most * (OWN_TIMES if detector == OURS and kind.views >= USUAL else 1))


def run_kind(kind, wanted, asked, results):
    """Rows of all detectors by view, those that hold and those that are made now.

    wanted: views by detector; any whole number is one. What was kept of others stays.
    """
    found = {detector: results.rows(kind, detector) for detector in asked}
    for view in sorted({view for views in wanted.values() for view in views}):
        missing = [detector for detector in asked if view in wanted[detector] and view not in found[detector]]
        if not missing:
            continue
        shot = kind.shot(view)
        if view == SHOWN:
            keep_tile(kind, shot, results.folder / "tiles")
        for detector in missing:
            answer, seconds = asked[detector].ask(shot.image, kind.target)
            found[detector][view] = measured(kind, detector, shot, answer, seconds)
            results.keep(kind, detector, found[detector])
    return {detector: {view: rows[view] for view in wanted[detector]} for detector, rows in found.items()}

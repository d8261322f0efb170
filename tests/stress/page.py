"""The page of evidence: figures of every kind, ours beside OpenCV's."""

from __future__ import annotations

import numpy as np

from pipelines.machine import facts
from tests.stress.answers import CLASSIC, OURS, SECTOR
from tests.stress.kinds import KINDS
from tests.stress.results import ROOT
from tests.stress.summary import NORMALISED, SLOWEST_S, faults, figures, shared_rms

EVIDENCE = ROOT / "docs" / "evidence" / "stress.md"
HEAD = f"""\
# Pictures as cameras spoil them

Pictures of a chessboard with a raised circle, drawn by an area sampling that shares nothing with the product: lenses
(pinhole, equidistance, Kannala-Brandt), boards and true points are formulas in `tests/stress`. The same views for every
kind: lens, tilt, turn and size at random; of two numbers of *views* the second is that for OpenCV's detectors. `make
stress` makes this page again and goes on where it stopped.

*found*: share of the corners in free sight that are called `ok` and lie on their own place; OpenCV finds a board as a
whole or not at all. *wrong*: points called `ok` that lie more than 0.3 squares from their own place, are hidden, or
belong to no board. RMS of a coordinate and length of the mean error (*bias*) are in px. *norm*: RMS of the error over
its stated deviation. OpenCV's corners are put in the order that fits the truth best; *classic* is
`findChessboardCorners` with `cornerSubPix`, *sector* is `findChessboardCornersSB` (exhaustive, accurate). Seconds are
processor time of one picture; 5 s is where a detector is ended. RMS *on shared* pictures is of
the views that both found.

Asked is: nothing wrong, corners found no less often and with an RMS no larger than OpenCV's better one, norm of corners
and of circles {NORMALISED[0]} to {NORMALISED[1]} (40 circles tell it to 8 %), no picture above {SLOWEST_S:g} s."""
REASONS = {
    "phone": "a filter that keeps edges leaves a shadow's rim another form than any lens",
}  # by kind, why it does not hold everything
COLUMNS = ["kind", "views", "found", "classic", "sector", "wrong", "RMS", "bias", "norm", "on shared: ours, classic",
           "ours, sector", "mean, slowest s", "classic s", "sector s"]  # fmt: skip


def write_page(found, path):
    """Rows by kind and detector as a page."""
    held = sum(not faults(rows) for rows in found.values())
    text = [
        HEAD,
        _made(),
        f"{held} of {len(found)} kinds hold everything that is asked.",
        "## Corners",
        _corners(found),
    ]
    text += ["## The circle", _discs(found), "## What is not held", _short(found), "## The kinds", _kinds(found)]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n\n".join(text) + "\n")


def _made():
    known = dict(facts())
    libraries = ", ".join(f"{name} {known[name]}" for name in ("python", "numpy", "opencv-python-headless", "numba"))
    return f"Made on {known['date']}, on a machine that other work shared: {known['processor']}; {libraries}."


def _corners(found):
    return _table(COLUMNS, [_row(name, rows) for name, rows in found.items()])


def _row(name, rows):
    own = figures(rows[OURS])
    others = {detector: figures(rows[detector]) for detector in (CLASSIC, SECTOR) if rows.get(detector)}
    share = [_number(others[d].found, 2) if d in others else "" for d in (CLASSIC, SECTOR)]
    pairs = [_pair(shared_rms(rows[OURS], rows[d]), 4) if d in others else "" for d in (CLASSIC, SECTOR)]
    times = [_pair((others[d].mean_s, others[d].slowest_s), 2) if d in others else "" for d in (CLASSIC, SECTOR)]
    views = _pair((own.views, max((other.views for other in others.values()), default=np.nan)), 0)
    return [name, views, _number(own.found, 2), *share, own.wrong, _number(own.rms_px, 4), _number(own.bias_px, 4),
            _number(own.normalised, 2), *pairs, _pair((own.mean_s, own.slowest_s), 2), *times]  # fmt: skip


def _discs(found):
    rows = []
    for name, detectors in found.items():
        own = figures(detectors[OURS], "disc")
        if np.isfinite(own.found):
            rows.append([name, _number(own.found, 2), own.wrong, _number(own.rms_px, 4), _number(own.bias_px, 4),
                         _number(own.normalised, 2)])  # fmt: skip
    return _table(["kind", "found", "wrong", "RMS", "bias", "norm"], rows)


def _short(found):
    said = []
    for name, rows in found.items():
        short = "; ".join(faults(rows))
        said += [f"- {name}: {short}{f' ({REASONS[name]})' if name in REASONS else ''}"] if short else []
    return "\n".join(said) or "Nothing."


def _kinds(found):
    def told(name):
        counts = figures(found[name][OURS]).status
        return ", ".join(f"`{status}` {count}" for status, count in counts.items())

    return _table(["kind", "what it is", "what our detection says of its points"],
                  [[name, KINDS[name].says, told(name)] for name in found])  # fmt: skip


def _pair(values, digits):
    return ", ".join(_number(value, digits) or "-" for value in values) if np.any(np.isfinite(values)) else ""


def _number(value, digits):
    return f"{value:.{digits}f}" if np.isfinite(value) else ""


def _table(columns, rows):
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)

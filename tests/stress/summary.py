"""Figures of one kind and detector over its views, and what is judged."""

from __future__ import annotations

import collections
from dataclasses import dataclass

import numpy as np

from tests.stress.answers import OURS

NORMALISED = 0.8, 1.3  # root mean square of error over stated deviation
SLOWEST_S = 2.0
CIRCLES = 10  # fewer tell their normalised error to worse than 16 %
ALLOWANCE = 1.05  # of OpenCV's RMS: two detectors that are equally good differ by so much


@dataclass(frozen=True)
class Figures:
    """Over all views of a kind."""

    views: int
    found: float  # share of the points seen, NaN if nothing is to be found
    used: int  # points called ok that are no wrong ones
    wrong: int  # points called ok that lie elsewhere, are hidden, or belong to no board
    rms_px: float  # of each coordinate
    bias_px: float  # length of the mean error
    normalised: float  # NaN without stated deviations
    mean_s: float
    slowest_s: float
    status: dict


def figures(rows, part=None):
    """Figures of rows by view; of the disc with `part`."""
    of = [row.get(part, {}) if part else row for row in rows.values()]

    def total(key):
        return sum(row.get(key, 0) for row in of)

    seen, used = total("seen"), total("used")
    mean = np.sum([row.get("sum", (0.0, 0.0)) for row in of], axis=0) / max(used, 1)
    stated = any("normalised" in row for row in of)
    seconds = [row["seconds"] for row in rows.values()]
    status = sum((collections.Counter(row["status"]) for row in rows.values()), collections.Counter())
    return Figures(
        views=len(rows),
        found=total("found") / seen if seen else np.nan,
        used=used,
        wrong=total("wrong"),
        rms_px=np.sqrt(total("square") / (2 * used)) if used else np.nan,
        bias_px=float(np.hypot(*mean)) if used else np.nan,
        normalised=np.sqrt(total("normalised") / (2 * used)) if used and stated else np.nan,
        mean_s=float(np.mean(seconds)),
        slowest_s=max(seconds),
        status=dict(status.most_common()),
    )


def shared_rms(ours, other):
    """RMS of ours and of another detector over the views that both found."""
    both = [view for view in ours if view in other and ours[view].get("used") and other[view].get("used")]
    sums = [[sum(rows[view][key] for view in both) for key in ("square", "used")] for rows in (ours, other)]
    return [float(np.sqrt(square / (2 * used))) if used else np.nan for square, used in sums]


def faults(found):
    """Sentences on what one kind's results, rows by detector, fall short of."""
    own = figures(found[OURS])
    said = [f"{own.wrong} points are called ok and are not"] if own.wrong else []
    if own.slowest_s > SLOWEST_S:
        said.append(f"slowest {own.slowest_s:.1f} s")
    if np.isfinite(own.normalised) and not NORMALISED[0] <= own.normalised <= NORMALISED[1]:
        said.append(f"normalised error {own.normalised:.2f}")
    said += _faults_of_circles(figures(found[OURS], "disc"))
    for detector in found.keys() - {OURS}:
        other, there = figures(found[detector]), figures({view: found[OURS][view] for view in found[detector]})
        if other.found > there.found:
            said.append(f"found {there.found:.3f}, {detector} {other.found:.3f} in the same pictures")
        rms, others = shared_rms(found[OURS], found[detector])
        if rms > ALLOWANCE * others:
            said.append(f"RMS {rms:.4f} px, {detector} {others:.4f} px on the same pictures")
    return said


def _faults_of_circles(own):
    said = [f"{own.wrong} circles are called ok and are not"] if own.wrong else []
    if own.used >= CIRCLES and not NORMALISED[0] <= own.normalised <= NORMALISED[1]:
        said.append(f"normalised error of the circle {own.normalised:.2f}")
    return said

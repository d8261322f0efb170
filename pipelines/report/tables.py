"""The plain tables of the report, as texts."""

from __future__ import annotations

from typing import Any

from datasets.schema import COMPONENTS
from pipelines.pages.numbers import two_digits
from pipelines.pages.sections import Table

FIELD_HEAD = (
    "camera", "field angle, deg", "local square, px", "corners", "found", "RMS per axis, px", "largest, px",
    "normalised", "failures",
)  # fmt: skip


def field_table(rows: list[dict[str, Any]]) -> Table:
    """Corners by field angle, from `points.field_rows`; the detector is told where there are several."""
    several = len({row["detector"] for row in rows}) > 1
    return Table(
        "Corners by field angle",
        (("detector",) if several else ()) + FIELD_HEAD,
        tuple(((row["detector"],) if several else ()) + _of_angle(row) for row in rows),
        "Corners that lie in the picture, within half a step of the angle. Local square: the side of a square of the "
        "board where the corner is. Failures: how many, and the status that they have.",
    )


def normalised_table(rows: list[dict[str, Any]]) -> Table:
    """Normalised pose errors by component, from `data.normalised_rows`."""
    return Table(
        "Pose errors over their stated standard deviations, RMS",
        ("setting", "solved", *COMPONENTS),
        tuple((row["setting"], str(row["n"]), *(f"{value:.2f}" for value in row["rms"])) for row in rows),
        "1 is honest. The rotation vector in the camera frame (w), then the translation (t), over the frames that were "
        "solved. Settings without known point noise state none.",
    )


def bound_table(rows: list[dict[str, Any]]) -> Table:
    """Pose errors over the pixels' bound, from `pixel_bound.bound_rows`."""
    return Table(
        "Pose errors over the pixels' bound, RMS",
        ("setting", "camera", "solved", "error over the pixels' bound", "covered"),
        tuple(
            (
                row["setting"], row["camera"], str(row["n"]), f"{row['over']:.2f}",
                "-" if row["covered"] is None else f"{100.0 * row['covered']:.0f} %",
            )
            for row in rows
        ),
        "The six pose errors together in units of the least that any unbiased solver reaches on the frame's pixels "
        "with the light unknown (Cramer-Rao); 1 is the best there is. Covered: errors within 1.96 stated deviations, "
        "of which 95 % is honest. Frames that failed are left out.",
    )  # fmt: skip


def _of_angle(row: dict[str, Any]) -> tuple[str, ...]:
    return (
        row["camera"], row["angle"], row["side"], str(row["corners"]), f"{100.0 * row['found']:.4g} %",
        two_digits(row["rms"]), two_digits(row["max"]),
        two_digits(row["normalised"]), row["failures"],
    )  # fmt: skip

"""Table I of the paper, its equation 6, and the angle that the released code takes: printed formulas evaluated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from eposit import Camera
from eposit.arrays import Array
from pipelines.pages.sections import Table
from pipelines.paper.claims import Claim, Statement, Verdict, holds_if, judged
from pipelines.paper.problems import OBJECT, helix

PART = "derivation"
ROUNDING = 1e-12  # relative, of such formulas in double precision
ANGLES = np.deg2rad(np.linspace(0.5, 89.5, 179))
FAR_DEG = 40.0
# Equations 1 to 5 as printed, r / f, and the denominators g of the ratios r_j / r_1 in table I.
PRINTED: dict[str, tuple[Callable[[Array], Array], Callable[[Array], Array]]] = {
    "perspective": (np.tan, np.cos),
    "stereographic": (lambda a: 2.0 * np.tan(a / 2.0), lambda a: np.cos(a / 2.0) ** 2),
    "equidistance": (lambda a: a, lambda a: np.sin(a) / a),
    "equisolid": (lambda a: 2.0 * np.sin(a / 2.0), lambda a: np.cos(a / 2.0)),
    "orthogonal": (np.sin, np.ones_like),
}
HEAD = ("lens", "ratio r_j / r_1 of table I", "equation 6", "our camera's radius against equations 1 to 5")


@dataclass(frozen=True, slots=True)
class Miss:
    """Largest relative errors of one lens."""

    ratio: float
    equation6: float
    camera: float


def measure() -> tuple[tuple[Table, ...], tuple[Claim, ...]]:
    """The table and the claims."""
    found = {lens: _miss(lens) for lens in PRINTED}
    rows = tuple(
        (lens, *(f"{value:.1e}" for value in (miss.ratio, miss.equation6, miss.camera))) for lens, miss in found.items()
    )
    table = Table("Largest relative error from 0.5 to 89.5 degrees off the axis", HEAD, rows)
    return (table,), judged(STATEMENTS, found)


def _miss(lens: str) -> Miss:
    radius, g = (law(ANGLES) for law in PRINTED[lens])
    camera = Camera(lens=lens, fx=1.0, fy=1.0, cx=0.0, cy=0.0, width=1, height=1)
    ours = camera.project(np.stack((np.sin(ANGLES), np.zeros_like(ANGLES), np.cos(ANGLES)), axis=1))[:, 0]
    parts = radius / np.tan(ANGLES) * g / np.cos(ANGLES), g * radius / np.sin(ANGLES), ours / radius
    return Miss(*(float(np.abs(part - 1.0).max()) for part in parts))


def _helix_deg() -> float:
    """The largest angle off the axis in the paper's simulation."""
    x, y, z = np.moveaxis(helix().apply(OBJECT), -1, 0)
    return float(np.degrees(np.arctan2(np.hypot(x, y), z)).max())


def _released_text(found: dict[str, Miss]) -> str:
    """How far theta = asin(r / f) is off for the fish-eye that it fits least."""
    del found
    told = list[str]()
    for degrees in (_helix_deg(), FAR_DEG):
        radii = [law(np.deg2rad(degrees)) for lens, (law, _) in PRINTED.items() if lens != "perspective"]
        off = max(abs(float(np.degrees(np.arcsin(radius))) - degrees) for radius in radii)
        told.append(f"by {off:.2g} deg at {degrees:.2g} deg")
    return f"theta = asin(r / f) for every lens, off {', '.join(told)}"


def _largest(found: dict[str, Miss], name: str) -> float:
    return max(getattr(miss, name) for miss in found.values())


STATEMENTS: tuple[Statement[dict[str, Miss]], ...] = (
    Statement(
        "II-B", "The ratios r_j / r_1 of table I", "cos(theta) / g_j(theta)",
        lambda found: f"relative error {_largest(found, 'ratio'):.1e} at most", _released_text,
        holds_if(lambda found: _largest(found, "ratio") < ROUNDING),
        "Identities of equations 1 to 5, evaluated as printed. At and beyond 90 degrees, which fish-eyes "
        "see, they are of no use: the pinhole's radius is infinite there.", PART,
    ),
    Statement(
        "II-B", "g_j(theta) r_j / f = sin(theta) (equation 6)", "equal",
        lambda found: f"relative error {_largest(found, 'equation6'):.1e} at most",
        "not used: theta comes from r = f sin(theta)",
        holds_if(lambda found: _largest(found, "equation6") < ROUNDING, Verdict.FAILS),
        "An identity; our cameras have the radii of equations 1 to 5 to the same rounding.", PART,
    ),
)  # fmt: skip

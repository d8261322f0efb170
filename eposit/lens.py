"""All lens laws by name: those of the paper, and those with coefficients."""

from __future__ import annotations

import numpy as np

from eposit.arrays import shown
from eposit.calibrated_lens import CALIBRATED, COEFFICIENTS
from eposit.lens_law import Lens

LENSES: dict[str, Lens] = {
    lens.name: lens
    for lens in (
        Lens(
            name="perspective",
            raw_rho=np.tan,
            raw_slope=lambda theta: 1.0 / np.cos(theta) ** 2,
            raw_g=np.cos,
            raw_theta=np.arctan,
            theta_max=np.pi / 2,
            includes_max=False,
            rho_max=np.inf,
        ),
        Lens(
            name="stereographic",
            raw_rho=lambda theta: 2.0 * np.tan(theta / 2.0),
            raw_slope=lambda theta: 1.0 / np.cos(theta / 2.0) ** 2,
            raw_g=lambda theta: np.cos(theta / 2.0) ** 2,
            raw_theta=lambda rho: 2.0 * np.arctan(rho / 2.0),
            theta_max=np.pi,
            includes_max=False,
            rho_max=np.inf,
        ),
        Lens(
            name="equidistance",
            raw_rho=lambda theta: theta,
            raw_slope=np.ones_like,
            raw_g=lambda theta: np.sinc(theta / np.pi),
            raw_theta=lambda rho: rho,
            theta_max=np.pi,
            includes_max=False,
            rho_max=np.pi,
        ),
        Lens(
            name="equisolid",
            raw_rho=lambda theta: 2.0 * np.sin(theta / 2.0),
            raw_slope=lambda theta: np.cos(theta / 2.0),
            raw_g=lambda theta: np.cos(theta / 2.0),
            raw_theta=lambda rho: 2.0 * np.arcsin(rho / 2.0),
            theta_max=np.pi,
            includes_max=False,
            rho_max=2.0,
        ),
        Lens(
            name="orthogonal",
            raw_rho=np.sin,
            raw_slope=np.cos,
            raw_g=np.ones_like,
            raw_theta=np.arcsin,
            theta_max=np.pi / 2,
            includes_max=True,
            rho_max=1.0,
        ),
    )
}

LENS_NAMES: tuple[str, ...] = (*LENSES, *CALIBRATED)


def get_lens(name: str, coefficients: tuple[float, ...] = ()) -> Lens:
    """The lens called `name`, with the coefficients that `COEFFICIENTS` names for it; the paper's lenses take none.

    Raises:
        ValueError: unknown name, or wrong coefficients.
    """
    if name in CALIBRATED:
        return CALIBRATED[name](tuple(float(k) for k in coefficients))
    if name not in LENSES:
        raise ValueError(f"unknown lens {shown(name)}; known lenses are {', '.join(LENS_NAMES)}")
    if len(coefficients):
        raise ValueError(f"lens {name!r} takes no coefficients, got {len(coefficients)}; leave `coefficients` empty")
    return LENSES[name]


def coefficients_text() -> str:
    """Which coefficients the lenses take, for the user."""
    return "; ".join(f"{', '.join(names)} of {name}" for name, (names, _) in COEFFICIENTS.items())

"""How often the stated 95 % region of a pose holds the truth."""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2

import eposit
from eposit.arrays import Array
from pipelines.pages.sections import Table
from pipelines.paper.claims import PaperSection
from pipelines.paper.problems import SIGMA_PX, camera_with, cloud, errors_of, helix, information, noisy
from pipelines.statistics import percent, wilson

CHI_SQUARE_95 = float(chi2.ppf(0.95, 6))  # for six degrees of freedom
CASES = (("perspective", 4), ("perspective", 20), ("orthogonal", 4), ("orthogonal", 20))
LENS_TEXT = {"perspective": "pinhole", "orthogonal": "orthogonal fish-eye"}


def coverage(trials: int = 20000, sigma_px: float = SIGMA_PX, seed: int = 2) -> PaperSection:
    """95 % regions from `solution.covariance`, and from the covariance at the truth, for four cases."""
    head = ("camera", "points", "covariance at the estimate", "covariance at the truth", "no pose")
    rows: list[tuple[str, ...]] = []
    for lens, n in CASES:
        estimate, truth = squared_errors(lens, n, trials, sigma_px, seed)
        lost = int(np.sum(~np.isfinite(estimate)))
        shares = (percent(wilson(squares <= CHI_SQUARE_95), 2) for squares in (estimate, truth))
        rows.append((LENS_TEXT[lens], str(n), *shares, str(lost)))
    title = f"Share of {trials} poses whose 95 % region holds the truth, with its 95 % interval"
    note = (
        f"Noise of {sigma_px:g} px, known to the solver; poses anywhere on the paper's helix. A pose that is missing "
        "counts as not held. The region is an ellipsoid in all six numbers together."
    )
    intro = (
        "The solver states a covariance. Where noise is small against what bends the equations, the squared error over "
        "it has a chi-square distribution with six degrees of freedom, and 95 % of the regions hold the truth."
    )
    return PaperSection("Stated uncertainty", intro, (Table(title, head, tuple(rows), note),))


def squared_errors(lens: str, n: int, trials: int, sigma_px: float, seed: int) -> tuple[Array, Array]:
    """(trials,) e^T C^-1 e with C at the estimate and at the truth; NaN without a pose."""
    camera, points, rng = camera_with(lens), cloud(n), np.random.default_rng(seed)
    path = helix()
    chosen = rng.integers(len(path.t), size=trials)
    pose = eposit.Pose(path.R[chosen], path.t[chosen])
    pixels = noisy(camera, points, pose, seed + 1, sigma_px)
    solution = eposit.solve(points, pixels, camera, sigma_px=sigma_px)
    error = errors_of(solution, pose)
    at_truth = np.einsum("bi,bij,bj->b", error, information(camera, points, pose, sigma_px), error)
    ok = np.all(np.isfinite(solution.covariance), axis=(1, 2))
    at_estimate = np.full(trials, np.nan)
    whitened = np.linalg.solve(solution.covariance[ok], error[ok][..., None])[..., 0]
    at_estimate[ok] = np.sum(error[ok] * whitened, axis=1)
    return at_estimate, at_truth

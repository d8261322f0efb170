"""The raised circle under one lamp and even surroundings, or, where these do not explain it, in light from everywhere.

A room has several lamps and windows. Each casts a shadow of its own, and where the disc's rim lies in one that the
model lacks, the rim seems to be elsewhere, by a hundredth of the radius and more.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from eposit.arrays import Array
from pipelines.detection.circle_even_light import in_even_light
from pipelines.detection.circle_model import STEPS, cost_of, fit_disc, shadow_of
from pipelines.detection.circle_numbers import (
    BLOCKED,
    DISC_SLOPE,
    LAMP,
    OBLONG,
    RIM,
    SHADOW,
    SHAPE,
    SIZE,
    WHITE_GREY,
    DiscFit,
    Patch,
    Prior,
)
from pipelines.detection.circle_patch import around_another_disc
from pipelines.detection.circle_scatter import confirmed

Rings = tuple[tuple[float, int], ...]

# Rings of shadows: heights by which they are displaced, and how many there are. Few tell whether one lamp is enough.
STARTS = ((0.0, 1), (1.0, 6))  # where the one shadow is looked for if it seems to be in a wrong place
TRIED, MANY_CELLS = 3, 16000  # of these starts are fitted, and one where the fine grid has more cells, for its time
FEW, FEW_SOFTNESS = ((0.5, 6), (1.2, 8), (2.4, 8)), 0.3
MANY, MANY_SOFTNESS = ((0.4, 6), (0.8, 8), (1.2, 10), (1.8, 12), (2.6, 12)), 0.2
FEWER_STEPS = 30  # of a fit of a large circle with further shadows, for its time
SPREAD = 0.1  # of the white's grey: light that may come from each direction beyond that of lamp and surroundings
MUCH_CLIPPED = 0.1  # of the pixels: edges look sharper than they are, and little of the shadow is left to see
DOUBTFUL = 1.05  # times the variance that is left with further shadows: the one may be in a wrong place
HOPELESS = 3.0  # times its residuals: a start that is so bad after some steps does not become better, of 96 none
MISSING = 1.2  # likewise: one lamp does not explain them
AS_GOOD = 0.01, 0.1  # of the residuals of the best, and where much is clipped: what a fit may leave more
UNLIKELY = 0.05  # likewise, for each part of light that cannot be: as much as the white has must explain far more
UNDECIDED = 9.0  # variances by which the sums of squares of two fits may differ: three deviations
NO_SLOPE, STRAY_SLOPE = 1e-6, 0.02  # of the disc's grey over a radius, times the white's; and where light strays on it
OTHER_FORM = 0.002  # of its size or form: a disc that differs from the map's by more casts its own shadow
PRINT_SPREAD = 0.01  # of the form, where the print is longer one way
SURE_GAIN = 15.0  # variances by which either must make the sum of squares less: noise does so once in 2000
POSSIBLE = 0.1  # of the white's grey: light that a fit may lack or have too much, by noise and rims of other forms
LEFT_OUT = 1.5  # times the stated error of a fit with many shadows: a lamp may stand between two directions


def fit_in_any_light(patch: Patch, known: Prior, height: float, light: float) -> DiscFit:
    """The simplest fit that explains the picture.

    Further shadows are taken only where they are needed: each makes the disc's place less certain.

    height: of the circle above the board, radii. light: grey value of the white.
    """
    plain, known = _in_any_form(fit_disc(patch, known), patch, known)
    plain, patch = _with_own_shadow(plain, patch, known, height)
    plain, patch = in_even_light(plain, patch, known)
    stray = _with_spread(known, DISC_SLOPE, STRAY_SLOPE * light)
    gain = plain.residual * len(patch.grey) - cost_of(patch, stray, plain.values[:SHAPE])
    if gain > SURE_GAIN * plain.residual * confirmed(known.scatter, plain.unexplained):
        known = stray
        plain = fit_disc(patch, known)
    unexplained = _unexplained(plain, patch, known, height, light)
    if unexplained > DOUBTFUL or not _is_possible(plain) or patch.clipped > MUCH_CLIPPED:
        starts = _best_starts(patch, known, height)
        hopeless = HOPELESS * plain.residual if plain.converged else np.inf
        others = (fit_disc(patch, replace(known, start=start), STEPS, hopeless) for start in starts)
        plain = _best_of([plain, *others], patch, known)
        plain, known = _in_any_form(plain, patch, known)
        unexplained = _unexplained(plain, patch, known, height, light)
    if unexplained <= MISSING or not plain.converged:
        return plain
    large = patch.blocked.size > MANY_CELLS
    lamps = (FEW, FEW_SOFTNESS) if large else (MANY, MANY_SOFTNESS)
    fit = fit_disc(*_lit(patch, known, *lamps, height, light), FEWER_STEPS if large else STEPS)
    if not fit.converged or fit.residual * DOUBTFUL > plain.residual:
        return plain  # many shadows that explain no more have led the disc astray
    return replace(fit, covariance=fit.covariance * LEFT_OUT**2)


def _in_any_form(fit: DiscFit, patch: Patch, known: Prior) -> tuple[DiscFit, Prior]:
    """The fit, again where the print seems to be longer one way, and what was known for it."""
    if fit.oblong <= SURE_GAIN:
        return fit, known
    known = _with_spread(known, OBLONG, PRINT_SPREAD)
    return fit_disc(patch, replace(known, start=fit.values[:SHAPE])), known


def _with_own_shadow(fit: DiscFit, patch: Patch, known: Prior, height: float) -> tuple[DiscFit, Patch]:
    """The fit, again with the shade of the disc that it found where that explains the picture better, and its patch.

    A board that is bent or printed too wide has another map than its disc. The shadow's own rim does not tell the
    disc's size: a lamp near by makes it larger, and one of another form than the model's moves it.
    """
    off = np.append(fit.values[OBLONG], fit.values[SIZE] - 1.0)
    if not fit.converged or np.max(np.abs(off)) < OTHER_FORM:
        return fit, patch
    own = around_another_disc(patch, fit.values[:SHAPE], height)
    again = fit_disc(own, replace(known, start=fit.values[:SHAPE]))
    return (again, own) if again.converged and again.residual < fit.residual else (fit, patch)


def _with_spread(known: Prior, which: slice, value: float) -> Prior:
    """What is known, but less of some numbers."""
    spread = known.spread.copy()
    spread[which] = value
    return replace(known, spread=spread)


def _is_possible(fit: DiscFit) -> bool:
    """Whether lamp and surroundings give light, together what falls on the white, and the rim is the lamp's."""
    return bool(fit.values[LAMP] > 0.0) and _impossible(fit) < POSSIBLE


def _impossible(fit: DiscFit) -> float:
    """Light that is there and cannot be, or is not and must, as a share of the white's."""
    white, blocked, lamp, rim = fit.values[[WHITE_GREY, BLOCKED, LAMP, RIM]]
    return float(max(-lamp, -blocked, max(lamp, 0.0) + max(blocked, 0.0) - white, -rim, rim - lamp) / white)


def _unexplained(fit: DiscFit, patch: Patch, known: Prior, height: float, light: float) -> float:
    """How many times its variance is that which further shadows would leave, the disc staying where it is.

    Variance is what is left for each pixel beyond the numbers that are fitted: as many more numbers make the residuals
    of a small circle a tenth less by fitting its noise.
    """
    lit, prior = _lit(patch, known, FEW, FEW_SOFTNESS, height, light)
    free = max(len(patch.grey) - len(known.mean), 1)
    freer = max(len(patch.grey) - len(prior.mean), 1)
    left = cost_of(lit, prior, fit.values[:SHAPE])
    return fit.residual * len(patch.grey) / free * freer / max(left, 1e-12)


def _best_of(fits: list[DiscFit], patch: Patch, known: Prior) -> DiscFit:
    """Of the fits with the smallest residuals, or as good, the one whose light is the most possible.

    How far others lie that are as good is in its covariance.
    """
    best = min(fits, key=lambda fit: (not fit.converged, fit.residual))
    undecided = UNDECIDED * known.scatter / len(patch.grey)
    unlikely = UNLIKELY * max(_impossible(best) - POSSIBLE, 0.0)
    limit = best.residual * (
        1.0 + max(AS_GOOD[int(patch.clipped > MUCH_CLIPPED)] * known.scatter, undecided) + unlikely
    )
    others = [fit for fit in fits if fit.converged and fit.residual < limit]
    best = min(others or [best], key=lambda fit: (max(_impossible(fit), POSSIBLE), fit.residual))
    apart = [fit.values - best.values for fit in others] or [0.0 * best.values]
    far = max(apart, key=lambda away: float(away[:2] @ away[:2]))
    return replace(best, covariance=best.covariance + np.outer(far, far))


def _best_starts(patch: Patch, known: Prior, height: float) -> list[Array]:
    """The starts whose shadow fits best: from a wrong place it may stay where none can be seen."""
    starts = []
    for place in _places(STARTS, height):
        starts.append(known.start.copy())
        starts[-1][SHADOW] = place
    tried = TRIED if patch.blocked.size <= MANY_CELLS else 1
    return sorted(starts, key=lambda start: cost_of(patch, known, start))[:tried]


def _places(rings: Rings, height: float) -> list[tuple[float, float]]:
    """Places of shadows, radii from the disc's foot."""
    turns = [(ring * height, 2.0 * np.pi * k / count) for ring, count in rings for k in range(count)]
    return [(far * float(np.cos(turn)), far * float(np.sin(turn))) for far, turn in turns]


def _lit(patch: Patch, known: Prior, rings: Rings, softness: float, height: float, light: float) -> tuple[Patch, Prior]:
    """The patch and what is known of it with the shadows of lamps all around."""
    places = _places(rings, height)
    shadows = np.array([shadow_of(patch.on_board, place, softness * height) for place in places])
    return replace(patch, shadows=shadows), known.with_fields(len(places), SPREAD * light)

"""The raised circle in an image whose board is known.

The centroid of a projected circle is not the projection of its centre. Here its contour is what the map from board to
image makes of a circle on a plane at its height; the map is good a square beyond the corners, and what it cannot know,
how far the height displaces the circle, is fitted (`pipelines.detection.circle_model`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize_scalar

from eposit.arrays import Array
from pipelines.detection.circle_blur import Blur, edge_blur, still
from pipelines.detection.circle_doubt import at_least, beyond_the_fit, moved_edges, unexplained_size
from pipelines.detection.circle_light import HOPELESS, MANY_CELLS, MUCH_CLIPPED, fit_in_any_light
from pipelines.detection.circle_map import MapErrors, map_errors, prediction_covariance
from pipelines.detection.circle_means import corners_in_means, picture_of_means, pixels_to_one
from pipelines.detection.circle_model import ROUNDING, cost_of, fit_disc
from pipelines.detection.circle_numbers import DISC_GREY, FURTHER, SHAPE, SIZE, WHITE_GREY, DiscFit, Patch, Prior
from pipelines.detection.circle_patch import Picture, circle_patch, of_one_field
from pipelines.detection.circle_prior import MISFIT_SLOPES, known_beforehand
from pipelines.detection.consistency import Corners
from render.targets.chessboard import Chessboard

WHITE_PERCENT = 95.0  # of the patch's pixels that are no brighter than its white, but for noise
SHARPENED = 1.0, 2.3, 0.3  # times as blurred as they look: from, to, by; then so many steps to what fits best
SHARPENED_STEPS = 6
LEFT_STEPS = 30  # of a fit that tells only what is left: it converges in as many or hardly
LEAST_CONTRAST = 0.35  # of the board's: what a circle's edge must have
SEARCH_SHARE = 0.1  # of a square: how far the centre may lie from where the board predicts it, if its map is sure
FARTHEST_SHARE = 0.25  # of a square, however unsure it is
SURE_SHARE = 0.01  # of a square: a prediction less sure than this has the circle looked for around it
LOOKS = (5, 9)  # places along both axes of the ellipse in which a circle is looked for
FEWER_LOOKS = (3, 7)  # likewise a large one
LOOK_SPREADS = 10.0  # half its axes, in deviations of the prediction: it is far from linear
GOOD_SHARE = 1.2  # of the residuals of the best fit in the ellipse, up to which a fit from the prediction is kept
FAR_SPREADS = 3.0  # of the prediction that a circle may lie off, for each that a linear map allows
USUALLY_LEFT, MOST_LEFT = 1.2, 30.0  # times the corners' noise that a fit leaves: no model of a disc explains more
SIZE_LIMIT = 0.03  # of the size
MOTION_SHARE = 0.8  # of the residuals of a picture that stood still, below which those of a motion must be
LEAST_AXIS = 1.5  # blurs: a disc whose smaller half axis is below this has no edges of its own


@dataclass(frozen=True, slots=True)
class Circle:
    """A circle found in an image."""

    centre_px: Array  # (2,) image of the circle's centre
    covariance_px2: Array  # (2, 2)


def find_circle(
    image: Picture, corners: Corners, at: Array, target: Chessboard, misfit: float = 0.0, motion: Blur | None = None
) -> Circle | None:
    """The circle's centre, or None if there is no dark disc where the board puts it.

    at: (n, 2) squares, of the corners. misfit: RMS distance of the corners from the board's map, squares. motion: the
    blur of a picture that moved.
    """
    board = corners.board
    foot, height = target.circle_centre[:2] / target.square_mm, target.circle_height_mm / target.square_mm
    radius = target.circle_radius_mm / target.square_mm
    axes = np.linalg.svd(board.jacobian(foot, height), compute_uv=False) * radius
    if axes[-1] < LEAST_AXIS * corners.blur_px:
        return None
    by = pixels_to_one(float(axes[0]), corners.blur_px, motion)
    unsure, known = prediction_covariance(board, target, image.shape), map_errors(corners, at, target, image.shape)
    if by > 1:
        image, motion = picture_of_means(image, by), motion and motion.in_means(by)
        corners = corners_in_means(corners, by)
    place = _Place(image, corners, target, misfit, unsure, known, None)
    if motion is not None:
        place = _likelier(place, replace(place, motion=motion))
    found = place.circle()
    return found and Circle((found.centre_px + 0.5) * by - 0.5, found.covariance_px2 * by**2)


def _likelier(still: _Place, moved: _Place) -> _Place:
    """Of two blurs that of a picture that stood still, unless the circle shows the motion, too.

    Lamps that flicker, reflections and noise can make the corners look as if they had moved.
    """
    return moved if moved.left(moved.blur) < MOTION_SHARE * still.left(still.blur) else still


@dataclass(frozen=True)
class _Place:
    """Where the board puts the circle, in a picture in which it is not too large."""

    image: Picture
    corners: Corners
    target: Chessboard
    misfit: float
    unsure: Array  # (3, 3) covariance of place, squares, and size, as a share, before the circle is looked at
    known: MapErrors
    motion: Blur | None  # of a picture that moved

    @property
    def radius(self) -> float:
        """Squares."""
        return self.target.circle_radius_mm / self.target.square_mm

    @property
    def height(self) -> float:
        """Above the board, radii."""
        return self.target.circle_height_mm / self.target.circle_radius_mm

    @cached_property
    def seen(self) -> tuple[Array, Array]:
        """The picture of the centre (2,) px, and its change with places on the circle's plane (2, 2), radii."""
        at, height = self.target.circle_centre[:2] / self.target.square_mm, self.height * self.radius
        return self.corners.board(at, height), self.corners.board.jacobian(at, height) * self.radius

    def circle(self) -> Circle | None:
        """The circle, if it is here."""
        fit = self._best_fit()
        left = np.nan if fit is None else fit.residual / max(self.corners.noise, ROUNDING)
        if fit is None or not fit.converged or abs(fit.values[SIZE] - 1.0) > SIZE_LIMIT or left > MOST_LEFT:
            return None
        shift, (centre, to_px) = fit.values[:2], self.seen
        dark = fit.values[WHITE_GREY] - fit.values[DISC_GREY] > LEAST_CONTRAST * self.corners.contrast
        if not dark or not _is_near(shift * self.radius, self.unsure):
            return None
        covariance = to_px @ fit.covariance[:2, :2] @ to_px.T * max(1.0, left / USUALLY_LEFT)
        radius_px, size = math.sqrt(abs(np.linalg.det(to_px))), fit.values[SIZE] - 1.0
        corners = np.median(self.corners.covariance_px2[self.corners.consistent], axis=0)
        corners += self.corners.rows_px2 * np.eye(2)  # its rim is not known to be moved
        misfit_px = self.misfit * radius_px / self.radius
        covariance += beyond_the_fit(to_px @ shift, corners, self._beyond, misfit_px, self._odd(fit), radius_px)
        covariance += to_px @ self.known.shift @ to_px.T
        sure = math.hypot(math.sqrt(self.unsure[2, 2]), MISFIT_SLOPES * self.misfit)
        resized = unexplained_size(size, sure, max(map(abs, self._beyond)) / radius_px) * (to_px @ fit.with_size)
        return Circle(centre + to_px @ shift, at_least(covariance, resized))

    @property
    def blur(self) -> Blur:
        """Of the circle's edges."""
        return self.motion or still(edge_blur(self.corners))

    def left(self, blur: Blur, hopeless: float = math.inf) -> float:
        """Variance of the residuals, grey values^2, of one fit with a blur. hopeless: of `fit_disc`."""
        patch = self._patch(blur)
        return np.inf if patch is None else fit_disc(patch, self._known(patch), LEFT_STEPS, hopeless).residual

    def _best_fit(self) -> DiscFit | None:
        """Of the circle where the board puts it and, if the place is unsure, of one that is looked for around it."""
        blur, doubt = self.blur, _looked_for(self.unsure)
        patch = self._patch(blur)
        if patch is not None and patch.clipped > MUCH_CLIPPED:
            blur = blur.scaled(self._sharpened(blur))
            patch = self._patch(blur)
        around = self._patch(blur, doubt) if doubt else None
        near = None if patch is None else self._fit(patch, self._known(patch))
        if around is None:
            return near
        known = self._known(around)
        start = _best_start(around, known, self.unsure, self.radius)
        if near is not None and around.blocked.size > MANY_CELLS and _is_beside(near, start, self.unsure, self.radius):
            return near
        far = self._fit(around, replace(known, start=start))
        if near is None or not near.converged:
            return far
        left, best = (cost_of(around, known, fit.values[:SHAPE]) for fit in (near, far))
        good = GOOD_SHARE * best + ROUNDING * len(around.grey)
        if left > good:
            return far
        return _unless_apart(near, far) if far.converged else near

    def _patch(self, blur: Blur, doubt: float = 0.0) -> Patch | None:
        return circle_patch(self.image, self.corners.board, self.seen, blur, self.target, doubt)

    def _fit(self, patch: Patch, known: Prior) -> DiscFit:
        light = self._light(patch)
        fit = fit_in_any_light(patch, known, self.height, light)
        if not fit.converged or not np.any(fit.fields_px):
            return fit
        fields = [of_one_field(patch, first, fit.fields_px) for first in range(2)]
        return _between(*(fit_in_any_light(field, known, self.height, light) for field in fields))

    def _known(self, patch: Patch) -> Prior:
        light, beyond, scatter = self._light(patch), max(map(abs, self._beyond)), self.corners.scatter
        return known_beforehand(light, self.height, self.misfit, beyond, self.known.form, scatter)

    @property
    def _beyond(self) -> tuple[float, float]:
        """Px by which the corners' edges along x and y are wider than their blur makes them; 0 where none tells."""
        if self.motion is not None:
            return 0.0, 0.0  # it was found from their widths
        along_x, along_y = np.nan_to_num(self.corners.widths_beyond_px)
        return float(along_x), float(along_y)

    def _odd(self, fit: DiscFit) -> float:
        """Px by which edges seem to be moved; none where it is a motion between rows that makes corners look odd."""
        if np.any(fit.fields_px):
            return 0.0
        corners = self.corners
        return moved_edges(corners.noise, fit.residual, corners.scatter, corners.contrast, corners.blur_px)

    def _light(self, patch: Patch) -> float:
        """Grey value of the white."""
        return max(self.corners.contrast, float(np.percentile(patch.grey, WHITE_PERCENT)))

    def _sharpened(self, blur: Blur) -> float:
        """Share of the blur that a picture has whose edges look sharper because it is clipped: what fits best."""

        found: list[float] = []

        def left(share: float) -> float:
            found.append(self.left(blur.scaled(share), HOPELESS * min(found, default=np.inf)))
            return found[-1]

        looks = np.arange(*SHARPENED)
        best = int(np.argmin([left(share) for share in looks]))
        between = looks[max(best - 1, 0)], looks[min(best + 1, len(looks) - 1)]
        return float(minimize_scalar(left, bounds=between, method="bounded", options={"maxiter": SHARPENED_STEPS}).x)


def _unless_apart(fit: DiscFit, other: DiscFit) -> DiscFit:
    """A fit; how far another one lies that explains the picture as well is in its covariance."""
    apart, covariance = other.values[:2] - fit.values[:2], fit.covariance.copy()
    covariance[:2, :2] += np.outer(apart, apart)
    return replace(fit, covariance=covariance)


def _between(even: DiscFit, odd: DiscFit) -> DiscFit:
    """Of two fits, each to every other row: the disc is where it was between the times at which these were taken."""
    return replace(
        even,
        values=0.5 * (even.values[:FURTHER] + odd.values[:FURTHER]),
        covariance=0.25 * (even.covariance[:FURTHER, :FURTHER] + odd.covariance[:FURTHER, :FURTHER]),
        converged=even.converged and odd.converged,
        residual=0.5 * (even.residual + odd.residual),
        with_size=0.5 * (even.with_size + odd.with_size),
    )


def _looked_for(unsure: Array) -> float:
    """Squares around the prediction in which the circle is looked for; 0 where the prediction is sure."""
    spread = math.sqrt(np.linalg.eigvalsh(unsure[:2, :2])[-1])
    return min(LOOK_SPREADS * spread, FARTHEST_SHARE) if spread > SURE_SHARE else 0.0


def _best_start(patch: Patch, known: Prior, unsure: Array, radius: float) -> Array:
    """The best start on a grid over the ellipse in which the prediction is unsure.

    unsure: covariance of the prediction, see `prediction_covariance`. radius: of the circle, squares.
    """
    looks = LOOKS if patch.blocked.size <= MANY_CELLS else FEWER_LOOKS
    reach, axes = _looked_at(unsure, radius)
    minor, major = (np.linspace(-far, far, count) for far, count in zip(reach, looks, strict=True))
    starts = [
        known.start + np.append(a * axes[:, 0] + b * axes[:, 1], np.zeros(SHAPE - 2)) for a in minor for b in major
    ]
    return min(starts, key=lambda start: cost_of(patch, known, start))


def _looked_at(unsure: Array, radius: float) -> tuple[Array, Array]:
    """(2,) half axes, radii, of the ellipse in which the circle is looked for, and (2, 2) their directions, columns."""
    variances, axes = np.linalg.eigh(unsure[:2, :2])
    return np.minimum(LOOK_SPREADS * np.sqrt(np.maximum(variances, 0.0)), FARTHEST_SHARE) / radius, axes


def _is_beside(fit: DiscFit, start: Array, unsure: Array, radius: float) -> bool:
    """Whether a fit, of a large circle, has arrived beside the best start: a fit from there would come to the same."""
    reach, axes = _looked_at(unsure, radius)
    apart = np.abs(axes.T @ (fit.values[:2] - start[:2]))
    return fit.converged and bool(np.all(apart <= 2.0 * reach / (np.array(FEWER_LOOKS) - 1.0)))


def _is_near(shift: Array, unsure: Array) -> bool:
    """Whether a circle that lies so many squares from its prediction is this board's."""
    allowed = FAR_SPREADS**2 * unsure[:2, :2] + (SEARCH_SHARE / 3.0) ** 2 * np.eye(2)
    return bool(shift @ np.linalg.solve(allowed, shift) < 9.0 and np.linalg.norm(shift) < FARTHEST_SHARE)

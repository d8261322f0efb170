"""What one system reads in a night's pictures, point by point, and the measures that the gates judge.

Poses follow from the points to first order, with the weights that the solver gives them: errors are thousandths of a
pixel, so that the second order is below a thousandth of a deviation (a test compares with the solver itself).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

import numpy as np

from datasets.schema import COMPONENTS
from pipelines.nightly.measures import Slice
from tests.pipelines.nightly.studies.pool import REGIMES

DETECTOR = "edge-fit"
ALL, FOUR, NOISY = "best detected exact all", "best detected exact four", "best truth+0.4px exact all"
NOISE_PX = 0.4


@dataclass(slots=True)
class Views:
    """The pictures of one suite: p poses of the pool in R regimes and C cameras, and a noise draw for each."""

    pool: object
    pose: np.ndarray  # (p,) in the pool
    draw: np.ndarray  # (R, p, C)
    noise_px: np.ndarray  # (p, N, 2) of the setting `truth+noise`, shared by the cameras of a pose
    noisy: dict = field(default_factory=dict)  # by camera, that setting's measures, the same for both sides
    clean: dict = field(default_factory=dict)  # by camera, its slices without a fault

    @classmethod
    def drawn(cls, pool, poses, rng):
        """Random poses of the pool, each once, with random noise."""
        pose = np.sort(rng.permutation(pool.slope.shape[0])[:poses])
        noise = NOISE_PX * rng.standard_normal((poses, pool.slope.shape[2], 2))
        shape = (len(REGIMES), poses, len(pool.cameras))
        return cls(pool, pose, rng.integers(pool.error.shape[1], size=shape), noise)

    def with_other_noise(self, rng):
        """The same poses in other pictures: no frame has the noise that it has here."""
        draws = self.pool.error.shape[1]
        other = (self.draw + rng.integers(1, draws, size=self.draw.shape)) % draws
        return Views(self.pool, self.pose, other, self.noise_px, self.noisy)

    def at(self, camera):
        """Index of the frames of one camera, (R, p), in the pool's arrays of (R, D, P, C)."""
        regime = np.arange(len(REGIMES))[:, None]
        return regime, self.draw[:, :, camera], self.pose[None], camera


@dataclass(slots=True)
class Seen:
    """The frames of one camera as a system sees them, which a fault may change."""

    error: np.ndarray  # (R, p, N, 2) px
    covariance: np.ndarray  # (R, p, N, 2, 2) px^2
    stretch: float = 0.0  # relative error of the focal length
    moves: dict[str, np.ndarray] = field(default_factory=dict)  # setting to (R, p, 6) by which poses are off


@dataclass(slots=True)
class Reading:
    """What a system read in a suite."""

    views: Views
    changed: dict[int, Seen] = field(default_factory=dict)  # by camera, only those that a fault touches
    failed: list[tuple[int, int, int]] = field(default_factory=list)  # regime, pose and camera without any point

    def seen(self, camera):
        """The frames of one camera, to change."""
        if camera not in self.changed:
            at, pool = self.views.at(camera), self.views.pool
            self.changed[camera] = Seen(pool.error[at].copy(), pool.covariance[at].copy())
        return self.changed[camera]

    def slices(self):
        """The measures as the gates take them; without a fault the same objects again and again."""
        found = []
        for camera in range(len(self.views.pool.cameras)):
            if camera in self.changed:
                found += self._of_camera(camera, self._changed(camera))
            elif any(camera == seen for _, _, seen in self.failed):
                found += self._of_camera(camera, self._clean(camera))
            else:
                if camera not in self.views.clean:
                    self.views.clean[camera] = self._of_camera(camera, self._clean(camera))
                found += self.views.clean[camera]
        return found

    def _of_camera(self, camera, values):
        return [
            self._slice(regime, camera, system, own) for regime in range(len(REGIMES)) for system, own in values.items()
        ]

    def _clean(self, camera):
        at = self.views.at(camera)
        known = clean_values(self.views.pool)
        found = {system: {name: value[at] for name, value in own.items()} for system, own in known.items()}
        if camera not in self.views.noisy:
            self.views.noisy[camera] = self._noisy(camera, 0.0, 0.0)
        return found | {NOISY: self.views.noisy[camera]}

    def _changed(self, camera):
        seen, pool, pose = self.changed[camera], self.views.pool, self.views.pose
        slope, offset = pool.slope[pose, camera], pool.offset[pose, camera]
        error = seen.error - seen.stretch * offset  # a longer focal length sees the points further out
        found = {DETECTOR: of_points(seen.error, seen.covariance, offset)}
        for setting, use in ((ALL, np.arange(slope.shape[1])), (FOUR, pool.four)):
            moves = seen.moves.get(setting, 0.0)
            found[setting] = of_poses(error[..., use, :], seen.covariance[..., use, :, :], slope[:, use], moves)
        return found | {NOISY: self._noisy(camera, seen.stretch * offset, seen.moves.get(NOISY, 0.0))}

    def _noisy(self, camera, stretched, moves):
        error = (self.views.noise_px - stretched)[None]
        covariance = np.broadcast_to(NOISE_PX**2 * np.eye(2), (*error.shape, 2))
        found = of_poses(error, covariance, self.views.pool.slope[self.views.pose, camera], moves)
        return {name: np.broadcast_to(value, (len(REGIMES), value.shape[1])) for name, value in found.items()}

    def _slice(self, regime, camera, system, values):
        poses = len(self.views.pose)
        gone = np.zeros(poses, bool)
        if system != NOISY:
            gone[[pose for of, pose, seen in self.failed if (of, seen) == (regime, camera)]] = True
        own = {name: value[regime] for name, value in values.items()}
        if np.any(gone):
            own = {name: np.where(gone, np.nan, value) for name, value in own.items()}
        frame = np.arange(poses) * len(self.views.pool.cameras) + camera
        return Slice(REGIMES[regime], self.views.pool.cameras[camera], system, frame, np.arange(poses), gone, own)


@functools.lru_cache(maxsize=2)
def clean_values(pool):
    """The measures of every frame of the pool without a fault: system to metric to (R, D, P, C)."""
    four = pool.error[..., pool.four, :], pool.covariance[..., pool.four, :, :], pool.slope[:, :, pool.four]
    return {
        DETECTOR: of_points(pool.error, pool.covariance, pool.offset),
        ALL: of_poses(pool.error, pool.covariance, pool.slope, 0.0),
        FOUR: of_poses(*four, 0.0),
    }


def of_points(error, covariance, offset):
    """Metrics of points from errors (..., N, 2) px, covariances and the way from the principal point, broadcast."""
    corners, circle = error[..., :-1, :], error[..., -1, :]
    out = offset[..., :-1, :] / np.linalg.norm(offset[..., :-1, :], axis=-1, keepdims=True)
    precise = _inverse(covariance[..., :-1, :, :])
    squares = np.sum(corners * (precise @ corners[..., None])[..., 0], axis=-1)
    return {
        "corner_x": np.mean(corners[..., 0], axis=-1),
        "corner_y": np.mean(corners[..., 1], axis=-1),
        "corner_radial": np.mean(np.sum(corners * out, axis=-1), axis=-1),
        "corner_log_ms": np.log(np.mean(corners**2, axis=(-1, -2))),
        "corner_nees": np.mean(squares, axis=-1) / 2.0,
        "circle_x": circle[..., 0],
        "circle_y": circle[..., 1],
    }


def of_poses(error, covariance, slope, moves):
    """Metrics of poses, to first order, from errors (..., n, 2) px and derivatives (..., n, 2, 6), broadcast."""
    n = 2 * error.shape[-2]
    weighted = _inverse(covariance) @ slope
    weighted = np.swapaxes(weighted.reshape(*weighted.shape[:-3], n, 6), -1, -2)
    normal = weighted @ slope.reshape(*slope.shape[:-3], n, 6)
    spread = np.linalg.inv(normal)
    moved = (spread @ (weighted @ error.reshape(*error.shape[:-2], n, 1)))[..., 0] + moves
    deviation = np.sqrt(np.einsum("...kk->...k", spread))
    values = {f"{name}_normalised": (moved / deviation)[..., i] for i, name in enumerate(COMPONENTS)}
    values["pose_nees"] = np.sum(moved * (normal @ moved[..., None])[..., 0], axis=-1) / 6.0
    values["pose_log_t"] = np.log(np.linalg.norm(moved[..., 3:], axis=-1))
    values["pose_log_R"] = np.log(np.degrees(np.linalg.norm(moved[..., :3], axis=-1)))
    return values


def _inverse(matrices):
    """Inverses of (..., 2, 2) symmetric matrices; NumPy's take ten times as long."""
    xx, xy, yy = matrices[..., 0, 0], matrices[..., 0, 1], matrices[..., 1, 1]
    return np.stack((yy, -xy, -xy, xx), axis=-1).reshape(matrices.shape) / (xx * yy - xy**2)[..., None, None]

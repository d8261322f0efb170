"""How blurred the edges of a board are, from its picture and a first map that may be a pixel off."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap
from pipelines.detection.corner_sites import CornerSites
from pipelines.detection.finders import Grey
from pipelines.spread import median_with_error

MOST_CORNERS = 9  # that are looked at
PLACES = (0.4, 0.55, 0.7)  # on an edge, in reaches from the corner: their profiles are averaged
LONGEST_PX = 14.0  # half a profile
STEP_PX = 0.5
LEAST_CONTRAST = 0.5  # of the median one: what a profile must have
ENDS = 0.2  # share of a profile at each end, which is taken for white or black
LIMITS_PX = (0.4, 6.0)
SAMPLING = 1.0 / 6.0  # variance that linear interpolation adds, px^2
SURE_WIDER = 2.0  # standard errors up to which it is chance
FALLBACK_PX = 0.8  # an ordinary lens in focus

Picture = Grey | NDArray[np.float32]  # (height, width) grey values


class EdgeProfiles(NamedTuple):
    """Grey values across edges, as shares between their ends."""

    shares: Array  # (k, s) 0 at the first end and 1 at the last one, but for noise
    step_px: Array  # (k,) px between samples
    rises: Mask  # (k,) whether the last end is the bright one
    along_y: Mask  # (k,) whether the edge runs along the board's y axis
    at: Array  # (k, 2) the corner beside it, squares

    def flat(self, values: Array) -> Array:
        """(k,) mean of values (k, s) over both ends, where the edge is not."""
        ends = _ends(values.shape[1])
        return 0.5 * (values[:, :ends].mean(axis=1) + values[:, -ends:].mean(axis=1))


def measured_blur(image: Picture, board: BoardMap, sites: CornerSites) -> float:
    """Standard deviation, px, of the blur of the edges beside the corners, the pixels' own area included.

    An edge's profile q, from 0 to 1, of a blur sigma has the integral of q (1 - q) equal to sigma / sqrt(pi), wherever
    the edge lies in it.
    """
    profiles = edge_profiles(image, board, sites)
    if profiles is None:
        return FALLBACK_PX
    sigma = float(np.median(profile_widths(profiles)))
    return float(np.clip(math.sqrt(max(sigma * abs(sigma) - SAMPLING, 0.0)), *LIMITS_PX))


def widths_beyond(image: Picture, board: BoardMap, sites: CornerSites, blur_px: float) -> Array:
    """(2,) by how many px edges along the board's x and y surely are wider than a gaussian blur makes them; NaN if not
    seen.

    Motion makes those along one axis wider than along the other. In a sharpened picture, the integral of q (1 - q) is
    less than the edge's slope says, as q goes beyond 0 and 1. Light that changes along q, as in waves from row to row,
    makes some edges look wider and others narrower.
    """
    profiles = edge_profiles(image, board, sites)
    if profiles is None or profiles.along_y.all() or not profiles.along_y.any():
        return np.full(2, np.nan)
    wider = profile_widths(profiles) - math.sqrt(blur_px**2 + SAMPLING)
    middles, errors = np.array([median_with_error(wider[profiles.along_y == along]) for along in (False, True)]).T
    return np.where(np.abs(middles) > SURE_WIDER * errors, middles, 0.0)


def profile_widths(profiles: EdgeProfiles) -> Array:
    """(k,) px, standard deviations of a gaussian whose edge has the same integral of q (1 - q)."""
    product = profiles.shares * (1.0 - profiles.shares)
    flat = np.minimum(profiles.flat(product), 0.0)  # noise alone makes it negative
    return math.sqrt(math.pi) * np.sum(product - flat[:, None], axis=1) * profiles.step_px


def edge_profiles(image: Picture, board: BoardMap, sites: CornerSites) -> EdgeProfiles | None:
    """Profiles of the clear edges beside some of the corners; None if no edge is clear."""
    at = sites.at[:: max(1, len(sites.at) // MOST_CORNERS)]
    profiles, step = _profiles(image, board, at, sites.reach)
    ends = _ends(profiles.shape[1])
    low, high = profiles[:, :ends].mean(axis=1), profiles[:, -ends:].mean(axis=1)
    contrast = high - low
    clear = np.abs(contrast) > LEAST_CONTRAST * np.median(np.abs(contrast))
    if not np.any(clear):
        return None
    along_y = np.arange(len(step)) >= len(step) // 2
    shares = (profiles[clear] - low[clear, None]) / contrast[clear, None]
    beside = np.tile(at, (len(step) // len(at), 1))[clear]
    return EdgeProfiles(shares, step[clear], contrast[clear] > 0.0, along_y[clear], beside)


def _ends(samples: int) -> int:
    """Samples of an end of a profile, which is taken for white or black."""
    return max(2, int(ENDS * samples))


def _profiles(image: Picture, board: BoardMap, at: Array, reach: float) -> tuple[Array, Array]:
    """(k, s) grey values across edges beside corners, and (k,) px between their samples, square to the edge.

    They run along the board's other axis: square to the edge, one would meet the next edge where the view is slanted.
    """
    jacobian, middle = board.jacobian(at), board(at)
    found: list[Array] = []
    steps: list[Array] = []
    lengths = np.linalg.norm(jacobian, axis=1)
    area = np.abs(np.linalg.det(jacobian))
    count = 2 * int(LONGEST_PX / STEP_PX) + 1
    for k in range(2):  # edges along x, then along y
        square = area / lengths[:, k]  # px, square to the edge
        half = np.minimum(LONGEST_PX, reach * square)
        aside = jacobian[:, :, 1 - k] * (half / square)[:, None]
        across = np.linspace(-1.0, 1.0, count)[:, None] * aside[:, None]
        for way in (1.0, -1.0):
            bases = [middle + way * place * reach * jacobian[:, :, k] for place in PLACES]
            places = np.stack([base[:, None] + across for base in bases]).astype(np.float32)
            grey = cv2.remap(
                image,
                places[..., 0].reshape(-1, count),
                places[..., 1].reshape(-1, count),
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            )
            found.append(grey.reshape(len(PLACES), len(at), count).mean(axis=0))
            steps.append(2.0 * half / (count - 1))
    return np.concatenate(found), np.concatenate(steps)

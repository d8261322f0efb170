"""The picture that a pose, a width of the point spread and a light would give, beside the one that was taken."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from eposit.arrays import Array
from eposit.pose import rotation_from_vector
from pipelines.photometric.image_flow import image_flow, plane_points
from pipelines.photometric.kernels import Sums, accumulate, light_picture
from pipelines.photometric.light_grid import FIELDS, LightGrid
from pipelines.photometric.point_spread import LEAST_SIGMA_PX, MOST_SIGMA_PX, PointSpread
from render.analytic.even_light import pixel_shares
from render.region import target_region
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region

AROUND_SIGMA, AROUND_PX = (
    3.0,
    2.0,
)  # pixels beyond the board's outline in use: so many widths of the point spread and px
SHADOW_HEIGHTS = 2.5  # of the circle above the board, around it: farther a lamp 22 degrees above the board casts none


class Shape(NamedTuple):
    """What is sought besides the light."""

    cam_from_obj: Pose
    sigma_px: float  # of the gaussian point spread

    def changed(self, step: Array) -> Shape:
        """After a step (7,): rotation vector on the left in the camera frame, rad; translation; sigma, px."""
        pose, sigma = self.cam_from_obj, float(np.clip(self.sigma_px + step[6], LEAST_SIGMA_PX, MOST_SIGMA_PX))
        return Shape(Pose(rotation_from_vector(step[:3]) @ pose.R, pose.t + step[3:6]), sigma)


class Modelled(NamedTuple):
    """The picture of a shape and a light, over the region's pixels row by row."""

    grey: Array  # (n,) grey values after the point spread
    channels: Array  # (5, n) as `kernels.accumulate` takes them


@dataclass(frozen=True, slots=True)
class PictureModel:
    """A region of a picture in which a target is, and what of its model does not change while the pose is refined.

    Where pixels look on the board, and how they move with the pose, is that of the pose at the start: it changes by a
    thousandth where the pose changes by a pixel.
    """

    target: Chessboard
    camera: Camera
    region: Region
    used: NDArray[np.int64]  # (m,) pixels of the region that are compared
    grid: LightGrid
    flow: Array  # (2, 6, n)

    @staticmethod
    def around(target: Chessboard, camera: Camera, shape: Shape, *, circle: bool = False) -> PictureModel:
        """The region of the target at a pose.

        circle: whether pixels that see the circle or what surrounds it are compared; nobody knows its shadow.

        Raises:
            ValueError: the target has no image in the picture.
        """
        pose = shape.cam_from_obj
        region = target_region(target, camera, pose)
        points, met = plane_points(camera, pose, region)
        seen = pixel_shares(target, camera, pose, region).target > 0.0
        reach = int(np.ceil(AROUND_SIGMA * shape.sigma_px + AROUND_PX))
        used = met & (cv2.dilate(seen.astype(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)).ravel() > 0)
        if circle:
            raised, ahead = plane_points(camera, pose, region, target.circle_centre[2])
            on_circle = ahead & (_from_circle(target, raised) <= target.circle_radius_mm)
            points[on_circle] = raised[on_circle]
        else:
            used &= _from_circle(target, points) > target.circle_radius_mm + SHADOW_HEIGHTS * target.circle_height_mm
        grid = LightGrid.over(target, points, target.square_mm)
        flow = np.nan_to_num(image_flow(camera, pose, points))
        return PictureModel(target, camera, region, np.flatnonzero(used), grid, flow)

    def observed(self, image: NDArray[np.uint8] | NDArray[np.float32]) -> Array:
        """(m,) grey values of the used pixels."""
        return image[self.region.pixels].ravel()[self.used].astype(np.float64)

    def dark(self) -> Array:
        """(nodes, 3) fields of no light."""
        return np.zeros((self.grid.node_count, FIELDS))

    def picture(self, shape: Shape, fields: Array) -> Modelled:
        """The model's picture and its derivatives."""
        shares = pixel_shares(self.target, self.camera, shape.cam_from_obj, self.region)
        light = np.empty(self.region.width * self.region.height)
        light_picture(
            shares.white.ravel(),
            shares.target.ravel(),
            self.grid.cells,
            self.grid.shares,
            self.grid.columns,
            fields,
            light,
        )
        lit, spread = light.reshape(shares.white.shape).astype(np.float32), PointSpread.of(shape.sigma_px)
        images = (
            spread.blurred(shares.white), spread.blurred(shares.target), *spread.gradient(lit), spread.widened(lit),
        )  # fmt: skip
        channels = np.stack([image.ravel() for image in images]).astype(np.float64)
        return Modelled(spread.blurred(lit).ravel().astype(np.float64), channels)

    def sums(self, modelled: Modelled, residuals: Array, weights: Array) -> Sums:
        """Sums of weighted least squares. residuals, weights: (m,)."""
        sums = Sums.zero(self.grid.cell_count)
        places = modelled.channels, self.flow, self.grid.cells, self.grid.shares
        accumulate(self.used, weights, residuals, *places, sums)
        return sums


def _from_circle(target: Chessboard, points: Array) -> Array:
    """(n,) distance of (n, 3) points from the circle's axis, mm."""
    return np.hypot(*(points[:, :2] - target.circle_centre[:2]).T)

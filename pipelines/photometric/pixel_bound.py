"""The Cramer-Rao bound of the pixels: the least covariance with which any unbiased solver can tell a pose from them.

It comes from the truth: the linear picture, the sensor's true point spread and noise. Unknown, beside the pose, are the
width of the point spread and the light, as three fields on the grid of `light_grid`.

Source:
    Kay, Fundamentals of Statistical Signal Processing I (1993), 3.9: the information of gaussian observations whose
    mean and variance depend on what is sought.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from eposit.arrays import Array
from pipelines.photometric.image_flow import POSE
from pipelines.photometric.kernels import Sums
from pipelines.photometric.normal_equations import solve
from pipelines.photometric.picture import Modelled, PictureModel, Shape
from pipelines.photometric.point_spread import LEAST_SIGMA_PX, PointSpread
from render.analytic.even_light import pixel_shares
from render.colour import luminance
from render.frame import LinearImage
from render.region import Image
from render.sensor.develop import MAX_GREY, FrameContext, develop
from render.sensor.optics import disc_kernel
from render.sensor.presets import SensorModel
from render.targets.chessboard import Chessboard

ROUNDING = 1.0 / 12.0  # variance of rounding to whole grey values
GAIN_EXPOSURE = 0.5  # at which the light's fall is read from a developed white picture, free of clipping
EVEN = {"psf_sigma_px": 0.0, "defocus_radius_px": 0.0, "exposure_s": 0.0, "full_well_e": 0.0, "read_noise_e": 0.0}


def pixel_bound(linear: LinearImage, sensor: SensorModel, frame: FrameContext) -> Array:
    """(6, 6) covariance bound of a frame's pose: rotation vector on the left in the camera frame, rad; then t.

    linear: the true picture without noise of its own. Motion during the exposure is left out: it is below a tenth of a
    pixel in all regimes but `harsh`.

    Raises:
        numpy.linalg.LinAlgError: the pixels do not determine the pose.
        ValueError: the target has no image in the picture, or is not the chessboard with its circle.
    """
    if not isinstance(frame.target, Chessboard):
        raise ValueError(f"the pixels' bound is for the chessboard with its circle, not {type(frame.target).__name__}")
    sigma = max(sensor.psf_sigma_px, LEAST_SIGMA_PX)
    model = PictureModel.around(frame.target, frame.camera, Shape(frame.cam_from_obj, sigma), circle=True)
    return solve(true_sums(model, linear, sensor, frame), model.grid, model.dark()).covariance[:POSE, :POSE]


def true_sums(model: PictureModel, linear: LinearImage, sensor: SensorModel, frame: FrameContext) -> Sums:
    """The information of the pixels on shape and light, as sums of weighted least squares without residuals.

    linear: of the model's region or of a larger one.
    """
    modelled = _expected(model, linear, sensor, frame)
    weights = _weights(modelled.grey[model.used], sensor)
    return model.sums(modelled, np.zeros(len(weights)), weights)


def _expected(model: PictureModel, linear: LinearImage, sensor: SensorModel, frame: FrameContext) -> Modelled:
    """The expected picture before the tone curve, 255 for full scale, and its derivatives."""
    crop = model.region.pixels
    scale = np.float32(MAX_GREY * sensor.exposure) * _fall_of_light(sensor, frame)[crop]
    full = linear.full(frame.camera)
    lit = ((luminance(full) if linear.in_colour else full)[crop] * scale).astype(np.float32, copy=False)
    shares = pixel_shares(model.target, model.camera, frame.cam_from_obj, model.region)
    lit, white, target = (_defocused(image, sensor.defocus_radius_px) for image in (lit, *shares))
    spread = PointSpread.of(max(sensor.psf_sigma_px, LEAST_SIGMA_PX))
    images = spread.blurred(white), spread.blurred(target), *spread.gradient(lit), spread.widened(lit)
    channels = np.stack([image.ravel() for image in images]).astype(np.float64)
    return Modelled(spread.blurred(lit).ravel().astype(np.float64), channels)


def _fall_of_light(sensor: SensorModel, frame: FrameContext) -> Image:
    """(height, width) light that an even scene of radiance 1 leaves on the sensor, as the sensor model develops it."""
    even = replace(sensor, **EVEN, exposure=GAIN_EXPOSURE, gamma=1.0)
    size = frame.camera.height, frame.camera.width
    return develop(np.ones(size, np.float32), even, frame).astype(np.float32) / np.float32(MAX_GREY * GAIN_EXPOSURE)


def _defocused(image: Image, radius_px: float) -> Image:
    if radius_px == 0.0:
        return image
    blurred = cv2.filter2D(image, -1, disc_kernel(radius_px), borderType=cv2.BORDER_REPLICATE)
    return blurred.astype(np.float32, copy=False)


def _weights(grey: Array, sensor: SensorModel) -> Array:
    """(m,) information of pixels on their expected grey value before the tone curve; none where they are clipped.

    Shot noise grows with the light, so that the scatter tells of the light as well.
    """
    share = np.clip(grey / MAX_GREY, 1e-6, 1.0)
    slope = share ** (1.0 / sensor.gamma - 1.0) / sensor.gamma  # of the tone curve
    variance, growth = ROUNDING / slope**2, 0.0
    if sensor.full_well_e > 0.0:
        electrons = share * sensor.full_well_e + sensor.read_noise_e**2
        variance = variance + electrons * (MAX_GREY / sensor.full_well_e) ** 2
        growth = MAX_GREY / sensor.full_well_e
    return np.where(share < 1.0, 1.0 / variance + 0.5 * (growth / variance) ** 2, 0.0)

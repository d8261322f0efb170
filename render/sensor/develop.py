"""Linear light to 8 bits by a sensor model. An image is rendered once and can be developed many times.

Light falls unevenly, is lost towards the corners, is spread by the lens, moves during the exposure, becomes electrons
with shot and read noise, and is clipped, curved and rounded.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from render.motion import PoseRate
from render.region import Image
from render.sensor.motion import Exposure
from render.sensor.motion_blur import motion_blurred
from render.sensor.noise import electron_noise
from render.sensor.optics import disc_kernel, natural_falloff, normalised_axes, vignetting_gain
from render.sensor.presets import SensorModel
from render.targets import Target
from render.targets.image_region import Region

MAX_GREY = 255.0
PSF_REACH_SIGMA = 5.0  # beyond which lies 6e-7 of a gaussian


@dataclass(frozen=True, slots=True)
class FrameContext:
    """What the sensor has to know of a frame besides its light."""

    target: Target
    camera: Camera
    cam_from_obj: Pose  # at mid-exposure
    rate: PoseRate
    region: Region  # of the picture where the board is
    seed: int  # of the noise and of the light's direction


def develop(radiance: Image, model: SensorModel, frame: FrameContext | None = None) -> NDArray[np.uint8]:
    """(height, width) linear radiance to 8-bit grey values of the same size; (height, width, 3) to RGB.

    Colours fall and spread alike, and each has noise of its own.

    frame: for models with noise, motion, uneven light or the lens's natural fall-off.

    Raises:
        ValueError: such a model without a frame.
    """
    bits = None if frame is None else np.random.SFC64(frame.seed)
    if bits is None and model.needs_frame:
        raise ValueError(
            "the sensor model has noise, motion, uneven light or natural fall-off; give the frame as `frame`"
        )
    direction = 0.0 if bits is None else 2.0 * np.pi * int(bits.random_raw()) / 2.0**64
    planes = [radiance] if radiance.ndim == 2 else [np.ascontiguousarray(radiance[..., i]) for i in range(3)]
    falling = [_on_the_sensor(plane, model, frame, direction) for plane in planes]
    light = falling[0] if radiance.ndim == 2 else np.stack(falling, axis=-1)
    linear = light * np.float32(model.exposure)
    if bits is not None and model.full_well_e > 0.0:
        linear += electron_noise(linear, model.full_well_e, model.read_noise_e, bits)
    return _digitise(linear, model)


def _on_the_sensor(radiance: Image, model: SensorModel, frame: FrameContext | None, direction: float) -> Image:
    """Light as the lens and the motion leave it. direction: in which it falls unevenly, rad."""
    light = _point_spread(_through_the_pupil(_uneven_light(radiance, model, direction), model, frame), model)
    if frame is None or model.exposure_s == 0.0:
        return light
    exposure = Exposure(frame.target, frame.camera, frame.cam_from_obj, frame.rate, model.exposure_s)
    spread_px = model.defocus_radius_px + PSF_REACH_SIGMA * model.psf_sigma_px
    return motion_blurred(light, exposure, frame.region, spread_px)


def _uneven_light(radiance: Image, model: SensorModel, direction: float) -> Image:
    """Light as it falls, unevenly, and as the lens lets it through, less towards the corners.

    The uneven light is a plane over the picture, 1 in its middle and 1 +- uneven in the corners that it falls towards.
    """
    size = radiance.shape[::-1]
    if model.uneven == 0.0:
        return radiance * vignetting_gain(*size, model.vignetting) if model.vignetting > 0.0 else radiance
    x, y = normalised_axes(*size)
    across = (1.0 + model.uneven * np.cos(direction) * x).astype(np.float32)
    gain = np.add.outer((model.uneven * np.sin(direction) * y).astype(np.float32), across)
    if model.vignetting > 0.0:
        gain *= vignetting_gain(*size, model.vignetting)
    gain *= radiance
    return gain


def _through_the_pupil(light: Image, model: SensorModel, frame: FrameContext | None) -> Image:
    """Light after the lens's natural fall-off."""
    if frame is None or model.natural_falloff == 0.0:
        return light
    return light * natural_falloff(frame.camera, model.natural_falloff)


def _point_spread(light: Image, model: SensorModel) -> Image:
    """Light after the disc of defocus and the lens's gaussian."""
    if model.defocus_radius_px > 0.0:
        disc = disc_kernel(model.defocus_radius_px)
        light = cv2.filter2D(light, -1, disc, borderType=cv2.BORDER_REPLICATE).astype(np.float32, copy=False)
    if model.psf_sigma_px > 0.0:
        # OpenCV samples the gaussian at pixel centres.
        size = 2 * int(np.ceil(PSF_REACH_SIGMA * model.psf_sigma_px)) + 1
        blurred = cv2.GaussianBlur(light, (size, size), model.psf_sigma_px, borderType=cv2.BORDER_REPLICATE)
        light = blurred.astype(np.float32, copy=False)
    return light


def _digitise(linear: Image, model: SensorModel) -> NDArray[np.uint8]:
    """Clip, curve and round, in the memory of `linear`."""
    np.clip(linear, 0.0, 1.0, out=linear)
    if model.gamma != 1.0:
        np.power(linear, np.float32(1.0 / model.gamma), out=linear)
    linear *= np.float32(MAX_GREY)
    return np.rint(linear, out=linear).astype(np.uint8)

"""Linear light to 8 bits by a sensor model. A master is rendered once and can be developed many times.

Light falls unevenly, is lost towards the corners, is spread by the lens, moves during the exposure, becomes electrons
with shot and read noise, and is clipped, curved and rounded.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from eposit.arrays import Array
from render.region import Image, Region
from render.sensor.motion import Rate, at_pixels, way_at_nodes
from render.sensor.noise import electron_noise
from render.sensor.optics import disc_kernel, from_middle, vignetting_gain
from render.sensor.presets import SensorModel
from render.targets.chessboard import Target

MAX_GREY = 255.0
LEAST_MOTION_PX = 0.05  # a way below this would widen a point spread of 0.7 px by less than 0.03 percent
SHORT_PX = 0.5  # up to here nine weights with the right moments are within half a grey level of the even way


@dataclass(frozen=True, slots=True)
class FrameContext:
    """What the sensor has to know of a frame besides its light."""

    target: Target
    camera: Camera
    cam_from_obj: Pose  # at mid-exposure
    rate: Rate
    region: Region  # of the picture where the board is
    seed: int  # of the noise and of the light's direction


def develop(radiance: Image, model: SensorModel, shot: FrameContext | None = None) -> NDArray[np.uint8]:
    """(height, width) linear radiance to 8-bit grey values of the same size.

    shot: the frame, for models with noise, motion or uneven light.

    Raises:
        ValueError: such a model without a frame.
    """
    bits = None if shot is None else np.random.SFC64(shot.seed)
    if bits is None and model.needs_frame:
        raise ValueError("the sensor model has noise, motion or uneven light; give the frame as `shot`")
    light = _spread(_lit(radiance, model, bits), model)
    if shot is not None and model.exposure_s > 0.0:
        light = _moved(light, model, shot)
    linear = light * np.float32(model.exposure)
    if bits is not None and model.full_well_e > 0.0:
        linear += electron_noise(linear, model.full_well_e, model.read_noise_e, bits)
    return _digitise(linear, model)


def _lit(radiance: Image, model: SensorModel, bits: np.random.SFC64 | None) -> Image:
    """Light as it falls and as the lens lets it through.

    The uneven light is a plane over the picture, 1 in its middle and 1 +- uneven in the corners that it falls towards.
    """
    size = radiance.shape[::-1]
    direction = 0.0 if bits is None else 2.0 * np.pi * int(bits.random_raw()) / 2.0**64
    if model.uneven == 0.0:
        return radiance * vignetting_gain(*size, model.vignetting) if model.vignetting > 0.0 else radiance
    x, y = from_middle(*size)
    across = (1.0 + model.uneven * np.cos(direction) * x).astype(np.float32)
    gain = np.add.outer((model.uneven * np.sin(direction) * y).astype(np.float32), across)
    if model.vignetting > 0.0:
        gain *= vignetting_gain(*size, model.vignetting)
    gain *= radiance
    return gain


def _spread(light: Image, model: SensorModel) -> Image:
    if model.defocus_radius_px > 0.0:
        disc = disc_kernel(model.defocus_radius_px)
        light = cv2.filter2D(light, -1, disc, borderType=cv2.BORDER_REPLICATE).astype(np.float32, copy=False)
    if model.psf_sigma_px > 0.0:
        # OpenCV samples the gaussian at pixel centres; the kernel reaches five sigma, beyond which lies 6e-7.
        size = 2 * int(np.ceil(5.0 * model.psf_sigma_px)) + 1
        blurred = cv2.GaussianBlur(light, (size, size), model.psf_sigma_px, borderType=cv2.BORDER_REPLICATE)
        light = blurred.astype(np.float32, copy=False)
    return light


def _moved(light: Image, model: SensorModel, shot: FrameContext) -> Image:
    """The mean over the exposure of the light around the board, which moves with it.

    The lens's spread comes first, though the light moves before: over its few pixels the motion is the same, so the
    order does not matter, and spread light can be interpolated with next to no further blur.
    """
    moving = (shot.target, shot.camera, shot.cam_from_obj, shot.rate, model.exposure_s)
    reach = _longest(way_at_nodes(*moving, shot.region))
    if reach < LEAST_MOTION_PX:
        return light
    spread = model.defocus_radius_px + 5.0 * model.psf_sigma_px
    region = _grown(shot.region, int(np.ceil(reach + spread)), light.shape)
    nodes = way_at_nodes(*moving, region)
    x, y, width, height = region
    way_x, way_y = at_pixels(nodes, width, height)
    part = light[y : y + height, x : x + width]
    reach, moved = _longest(nodes), light.copy()
    moved[y : y + height, x : x + width] = (
        _short_way(part, way_x, way_y) if reach <= SHORT_PX else _long_way(part, way_x, way_y, reach)
    )
    return moved


def _short_way(part: Image, way_x: Image, way_y: Image) -> Image:
    """Blur by nine weights with the moments of an even way: mean 0, variance way^2 / 12."""
    kernels = (
        (way_x * way_x, [[0, 0, 0], [1, -2, 1], [0, 0, 0]]),
        (way_y * way_y, [[0, 1, 0], [0, -2, 0], [0, 1, 0]]),
        (way_x * way_y, [[0.5, 0, -0.5], [0, 0, 0], [-0.5, 0, 0.5]]),
    )
    total = part.copy()
    for variance, bend in kernels:
        kernel = np.array(bend, np.float32) / np.float32(24.0)
        total += variance * cv2.filter2D(part, -1, kernel, borderType=cv2.BORDER_REPLICATE)
    return total


def _long_way(part: Image, way_x: Image, way_y: Image, reach: float) -> Image:
    """The mean of the light at the moments of Gauss and Legendre, which lie symmetrically about mid-exposure.

    They are at most 0.7 px apart or so, interpolated by Lanczos over 8 x 8 pixels.
    """
    columns, rows = np.arange(part.shape[1], dtype=np.float32), np.arange(part.shape[0], dtype=np.float32)[:, None]
    total = np.zeros_like(part)
    for moment, weight in zip(*np.polynomial.legendre.leggauss(1 + int(np.ceil(reach / 0.7))), strict=True):
        back = np.float32(-0.5 * moment)
        there = columns + back * way_x, rows + back * way_y
        then = cv2.remap(part, *there, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REPLICATE)
        total += np.float32(0.5 * weight) * then
    return total


def _longest(nodes: Array) -> float:
    return float(np.max(np.hypot(nodes[..., 0], nodes[..., 1])))


def _grown(region: Region, margin: int, shape: tuple[int, ...]) -> Region:
    x, y, width, height = region
    low = max(x - margin, 0), max(y - margin, 0)
    high = min(x + width + margin, shape[1]), min(y + height + margin, shape[0])
    return low[0], low[1], high[0] - low[0], high[1] - low[1]


def _digitise(linear: Image, model: SensorModel) -> NDArray[np.uint8]:
    """Clip, curve and round, in the memory of `linear`."""
    np.clip(linear, 0.0, 1.0, out=linear)
    if model.gamma != 1.0:
        np.power(linear, np.float32(1.0 / model.gamma), out=linear)
    linear *= np.float32(MAX_GREY)
    return np.rint(linear, out=linear).astype(np.uint8)

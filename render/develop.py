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
from render.master import Image, Region
from render.motion import Rate, displacement
from render.optics import disc_kernel, from_middle, vignetting_gain
from render.regimes import SensorModel
from render.target import Target

MAX_GREY = 255.0
LEAST_MOTION_PX = 0.2  # a way below this would widen a point spread of 0.7 px by less than 0.3 percent


@dataclass(frozen=True, slots=True)
class Shot:
    """What the sensor has to know of a frame besides its light."""

    target: Target
    camera: Camera
    cam_from_obj: Pose  # at mid-exposure
    rate: Rate
    region: Region  # of the picture where the board is
    seed: int  # of the noise and of the light's direction


def develop(radiance: Image, model: SensorModel, shot: Shot | None = None) -> NDArray[np.uint8]:
    """(height, width) linear radiance to 8-bit grey values of the same size.

    shot: the frame, for models with noise, motion or uneven light.

    Raises:
        ValueError: such a model without a frame.
    """
    if shot is None:
        if model.needs_frame:
            raise ValueError("the sensor model has noise, motion or uneven light; give the frame as `shot`")
        return _digitise(_spread(_vignetted(radiance, model), model) * np.float32(model.exposure), model)
    rng = np.random.Generator(np.random.SFC64(shot.seed))
    light = _spread(_unevenly_lit(_vignetted(radiance, model), model, rng), model)
    if model.exposure_s > 0.0:
        light = _moved(light, model, shot)
    return _digitise(_noisy(light * np.float32(model.exposure), model, rng), model)


def _vignetted(light: Image, model: SensorModel) -> Image:
    return light * vignetting_gain(*light.shape[::-1], model.vignetting) if model.vignetting > 0.0 else light


def _unevenly_lit(light: Image, model: SensorModel, rng: np.random.Generator) -> Image:
    """A plane over the picture, 1 in its middle and 1 +- uneven in the corners if it falls along the diagonal."""
    direction = rng.uniform(0.0, 2.0 * np.pi)
    if model.uneven == 0.0:
        return light
    x, y = from_middle(*light.shape[::-1])
    across = (1.0 + model.uneven * np.cos(direction) * x).astype(np.float32)
    down = (model.uneven * np.sin(direction) * y).astype(np.float32)
    return light * np.add.outer(down, across)


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


def _moved(light: Image, model: SensorModel, shot: Shot) -> Image:
    """The mean over the exposure of the light around the board, which moves with it.

    The lens's spread comes first, though the light moves before: over its few pixels the motion is the same, so the
    order does not matter, and spread light can be interpolated (Lanczos, 8 x 8 pixels) with next to no further blur.
    The moments are those of Gauss and Legendre, symmetric about mid-exposure: nothing moves in the mean.
    """
    moving = (shot.target, shot.camera, shot.cam_from_obj, shot.rate, model.exposure_s)
    reach = _longest(displacement(*moving, shot.region))
    if reach < LEAST_MOTION_PX:
        return light
    spread = model.defocus_radius_px + 5.0 * model.psf_sigma_px
    x, y, width, height = _grown(shot.region, int(np.ceil(reach + spread)), light.shape)
    way = displacement(*moving, (x, y, width, height))
    here = np.stack(np.meshgrid(np.arange(x, x + width), np.arange(y, y + height)), axis=-1).astype(np.float32)
    moments, weights = np.polynomial.legendre.leggauss(2 + int(np.ceil(_longest(way))))
    total = np.zeros((height, width), np.float32)
    for moment, weight in zip(moments, weights, strict=True):
        there = here - np.float32(0.5 * moment) * way
        then = cv2.remap(light, there, None, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REPLICATE)  # pyright: ignore
        total += np.float32(0.5 * weight) * then
    blurred = light.copy()
    blurred[y : y + height, x : x + width] = total
    return blurred


def _longest(way: Image) -> float:
    return float(np.sqrt(np.max(np.sum(way * way, axis=-1))))


def _grown(region: Region, margin: int, shape: tuple[int, ...]) -> Region:
    x, y, width, height = region
    low = max(x - margin, 0), max(y - margin, 0)
    high = min(x + width + margin, shape[1]), min(y + height + margin, shape[0])
    return low[0], low[1], high[0] - low[0], high[1] - low[1]


def _noisy(linear: Image, model: SensorModel, rng: np.random.Generator) -> Image:
    """Shot and read noise on light as a share of full scale.

    Both together as one gaussian with the right mean and variance. Above twenty electrons that is all that can be
    told of Poisson's law; below, its skewness is lost, and the read noise covers it.
    """
    if model.full_well_e == 0.0:
        return linear
    well = np.float32(model.full_well_e)
    variance = np.maximum(linear, np.float32(0.0))
    variance *= np.float32(1.0) / well
    variance += np.float32((model.read_noise_e / model.full_well_e) ** 2)
    noise = rng.standard_normal(linear.shape, dtype=np.float32)
    noise *= np.sqrt(variance, out=variance)
    noise += linear
    return noise


def _digitise(linear: Image, model: SensorModel) -> NDArray[np.uint8]:
    linear = np.clip(linear, 0.0, 1.0)
    encoded = linear if model.gamma == 1.0 else linear ** np.float32(1.0 / model.gamma)
    return np.rint(encoded * np.float32(MAX_GREY)).astype(np.uint8)


def encode_png(image: NDArray[np.uint8]) -> bytes:
    """PNG bytes of an 8-bit grey image."""
    _, encoded = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 3])
    return encoded.tobytes()


def decode_png(data: bytes) -> NDArray[np.uint8]:
    """(height, width) grey values of PNG bytes.

    Raises:
        ValueError: not a grey 8-bit image.
    """
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    if image is None or image.ndim != 2 or image.dtype != np.uint8:
        raise ValueError("the image is not an 8-bit grey PNG")
    return image.astype(np.uint8, copy=False)

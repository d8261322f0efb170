"""The sensor model: linear light to 8 bits. A master is rendered once and can be developed many times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray

from render.master import Image

MAX_GREY = 255.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorModel:
    """Exposure, gaussian point spread, transfer curve, 8 bits.

    Raises:
        ValueError: an exposure, point spread or gamma out of range.
    """

    exposure: Annotated[float, "grey value, as a share of full scale, of radiance 1: the white board at its centre"] = (
        0.8
    )
    psf_sigma_px: Annotated[float, "standard deviation of the gaussian point spread, px; 0 for none"] = 0.7
    gamma: Annotated[float, "grey = linear ** (1 / gamma); 1 is a linear camera, 2.2 a display-like one"] = 1.0

    def __post_init__(self) -> None:
        if not 0.0 < self.exposure <= 100.0:
            raise ValueError(f"sensor exposure is {self.exposure}; it must be above 0 and at most 100")
        if not 0.0 <= self.psf_sigma_px <= 10.0:
            raise ValueError(f"sensor psf_sigma_px is {self.psf_sigma_px}; it must lie in 0 to 10 px")
        if not 0.2 <= self.gamma <= 5.0:
            raise ValueError(f"sensor gamma is {self.gamma}; it must lie in 0.2 to 5")


def develop(radiance: Image, model: SensorModel) -> NDArray[np.uint8]:
    """(height, width) linear radiance to 8-bit grey values of the same size."""
    spread = radiance
    if model.psf_sigma_px > 0.0:
        # OpenCV samples the gaussian at pixel centres; the kernel reaches five sigma, beyond which lies 6e-7.
        size = 2 * int(np.ceil(5.0 * model.psf_sigma_px)) + 1
        spread = cv2.GaussianBlur(radiance, (size, size), model.psf_sigma_px, borderType=cv2.BORDER_REPLICATE)
    linear = np.clip(spread * np.float32(model.exposure), 0.0, 1.0)
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

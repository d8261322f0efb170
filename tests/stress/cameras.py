"""What cameras make of linear radiance: exposure, noise, tone curve, sharpening, mosaic, compression."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.ndimage import convolve, gaussian_filter, median_filter

GAIN = 250.0  # grey values for radiance 1: white is 200, black 12


def camera(gain=GAIN, noise=1.0, full_well=0.0, offset=0.0, tone=None, after=None, bits=8):
    """A camera with read noise in grey values, shot noise if a full well (electrons) is given, a tone curve of 0..1.

    `after` works on the finished 8-bit picture.
    """

    def make(linear, rng):
        signal = np.maximum(linear, 0.0) * gain / 255.0
        if full_well:
            signal = rng.poisson(signal * full_well) / full_well
        grey = 255.0 * (tone(np.clip(signal, 0.0, 1.0)) if tone else signal) + offset
        top = 2**bits - 1
        grey = (grey + noise * rng.standard_normal(grey.shape)) * (top / 255.0)
        image = np.clip(np.rint(grey), 0, top).astype(np.uint8 if bits == 8 else np.uint16)
        return image if after is None else after(image, rng)

    return make


def gamma(signal):
    """The usual tone curve of pictures for screens."""
    return signal ** (1.0 / 2.2)


def jpeg(quality):
    """Compressed and read again."""

    def after(image, rng):
        done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
        assert done
        return cv2.imdecode(data, cv2.IMREAD_UNCHANGED)

    return after


def unsharp(amount, sigma):
    """Sharpened as in cameras: the difference to a blurred copy is added."""

    def after(image, rng):
        grey = image.astype(float)
        return _eight_bits(grey + amount * (grey - gaussian_filter(grey, sigma)))

    return after


def in_turn(*steps):
    """One step after the other."""

    def after(image, rng):
        for step in steps:
            image = step(image, rng)
        return image

    return after


def hot_pixels(share):
    """Single pixels that are white or black whatever falls on them."""

    def after(image, rng):
        where = rng.uniform(size=image.shape)
        return np.where(where < share / 2, 255, np.where(where > 1.0 - share / 2, 0, image)).astype(np.uint8)

    return after


def median(size):
    """A noise filter."""
    return lambda image, rng: median_filter(image, size, mode="nearest")


def bilateral(image, rng):
    """A noise filter that keeps edges, as phones have it."""
    return cv2.bilateralFilter(image, 7, 30.0, 3.0)


def enlarged(scale):
    """A picture enlarged by an integer; pixel centres stay where the truth's `shift` puts them."""
    return lambda image, rng: cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)


def equalised(image, rng):
    """Local contrast enhancement."""
    return cv2.createCLAHE(3.0, (8, 8)).apply(image)


def colour(image, rng):
    """Three channels with a colour cast, as a file in colour has them."""
    tint = np.array([0.85, 1.0, 0.95])
    return _eight_bits(image[..., None] * tint)


def mosaic(image, rng):
    """A Bayer sensor under reddish light, its colours interpolated linearly, balanced, made grey."""
    gains = {"r": 0.9, "g": 1.0, "b": 0.6}
    rows, columns = np.indices(image.shape)
    colours = np.where(rows % 2 == 0, np.where(columns % 2 == 0, "r", "g"), np.where(columns % 2 == 0, "g", "b"))
    raw = np.rint(image * np.select([colours == c for c in gains], list(gains.values())))
    cross = np.array([[1.0, 2.0, 1.0], [2.0, 4.0, 2.0], [1.0, 2.0, 1.0]])
    planes = [convolve(raw * (colours == c), cross) / convolve((colours == c) * 1.0, cross) / gains[c] for c in gains]
    return _eight_bits(np.tensordot([0.299, 0.587, 0.114], planes, axes=1))


def _eight_bits(grey):
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)

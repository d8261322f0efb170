"""Lens laws with coefficients, as calibration programs give them."""

from __future__ import annotations

import functools

import numpy as np

from eposit.arrays import Array
from eposit.lens_law import Lens, invert_rising

KANNALA_BRANDT = "kannala_brandt"
PINHOLE_RADIAL = "pinhole_radial"
EUCM = "eucm"
DOUBLE_SPHERE = "double_sphere"
# Names of each lens's coefficients in their order, and whose calibration has them so.
COEFFICIENTS: dict[str, tuple[tuple[str, ...], str]] = {
    KANNALA_BRANDT: (("k1", "k2", "k3", "k4"), "cv2.fisheye"),
    PINHOLE_RADIAL: (("k1", "k2", "k3"), "OpenCV's pinhole camera without its tangential p1 and p2"),
    EUCM: (("alpha", "beta"), "Kalibr"),
    DOUBLE_SPHERE: (("xi", "alpha"), "Kalibr"),
}
MOST_COEFFICIENT = 1e12  # of any lens: with larger ones powers of its polynomials are infinite
LEAST_COEFFICIENT = 1e-200  # smaller leading ones change nothing at any angle, and dividing by them overflows
MOST_COEFFICIENTS = max(len(names) for names, _ in COEFFICIENTS.values())


@functools.lru_cache(maxsize=256)
def kannala_brandt(coefficients: tuple[float, ...]) -> Lens:
    """rho = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8), valid while it rises.

    Raises:
        ValueError: not exactly four finite coefficients.
    Source:
        Kannala and Brandt 2006, in the form of OpenCV's `cv2.fisheye`.
    """
    _require(KANNALA_BRANDT, coefficients)
    even = np.polynomial.Polynomial([1.0, *coefficients])  # rho / theta, in theta squared
    rise = np.polynomial.Polynomial([1.0, *(k * (2 * i + 3) for i, k in enumerate(coefficients))])
    theta_max = min(_first_turn(rise), np.pi)
    rho_max = float(theta_max * even(theta_max**2))

    def raw_rho(theta: Array) -> Array:
        return theta * even(theta**2)

    def raw_slope(theta: Array) -> Array:
        return rise(theta**2)

    return Lens(
        name=KANNALA_BRANDT,
        raw_rho=raw_rho,
        raw_slope=raw_slope,
        raw_g=lambda theta: np.sinc(theta / np.pi) / even(theta**2),
        raw_theta=lambda rho: invert_rising(raw_rho, raw_slope, rho, theta_max, np.minimum(rho, theta_max)),
        theta_max=theta_max,
        includes_max=theta_max < np.pi,
        rho_max=rho_max,
    )


@functools.lru_cache(maxsize=256)
def pinhole_radial(coefficients: tuple[float, ...]) -> Lens:
    """rho = t (1 + k1 t^2 + k2 t^4 + k3 t^6) with t = tan(theta), valid while it rises.

    It is the radial part of OpenCV's pinhole camera. Its tangential part, p1 and p2, moves points to the side of their
    radius: no lens law, and left out; a lens that has it is not one of these.

    Raises:
        ValueError: not exactly three finite coefficients.
    Source:
        Brown 1966, in the form of OpenCV's `cv2.projectPoints`.
    """
    _require(PINHOLE_RADIAL, coefficients)
    even = np.polynomial.Polynomial([1.0, *coefficients])  # rho / t, in t squared
    rise = np.polynomial.Polynomial([1.0, *(k * (2 * i + 3) for i, k in enumerate(coefficients))])
    turn = _first_turn(rise)
    theta_max = float(np.arctan(turn))

    def raw_rho(theta: Array) -> Array:
        tangent = np.tan(theta)
        return tangent * even(tangent**2)

    def raw_slope(theta: Array) -> Array:
        tangent = np.tan(theta)
        return rise(tangent**2) * (1.0 + tangent**2)

    def raw_theta(rho: Array) -> Array:
        tangent = rho  # far out a power of t outweighs the others
        for power, k in zip((3, 5, 7), coefficients, strict=True):
            tangent = np.minimum(tangent, (rho / k) ** (1.0 / power)) if k > 0.0 else tangent
        return invert_rising(raw_rho, raw_slope, rho, theta_max, np.minimum(np.arctan(tangent), theta_max))

    return Lens(
        name=PINHOLE_RADIAL,
        raw_rho=raw_rho,
        raw_slope=raw_slope,
        raw_g=lambda theta: np.cos(theta) / even(np.tan(theta) ** 2),
        raw_theta=raw_theta,
        theta_max=theta_max,
        includes_max=bool(np.isfinite(turn)),
        rho_max=float(turn * even(turn**2)) if np.isfinite(turn) else np.inf,
    )


@functools.lru_cache(maxsize=256)
def eucm(coefficients: tuple[float, ...]) -> Lens:
    """rho = sin(theta) / (alpha d + (1 - alpha) cos(theta)), d = sqrt(beta sin^2(theta) + cos^2(theta)).

    Raises:
        ValueError: not two coefficients, alpha outside 0 to 1, or beta not above 0.
    Source:
        Khomutenko, Garcia and Martinet 2016, "An enhanced unified camera model", equations 7 and 20.
    """
    _require(EUCM, coefficients)
    alpha, beta = coefficients
    if not 0.0 <= alpha <= 1.0 or not beta > 0.0:
        raise ValueError(f"lens 'eucm' has alpha {alpha} and beta {beta}; alpha must lie in 0 to 1, beta above 0")
    # Up to alpha 1/2 the image reaches infinity where cos(theta) = -w d; beyond, it turns back there.
    w = min(alpha, 1.0 - alpha) / max(alpha, 1.0 - alpha)
    theta_max = float(np.arctan2(np.sqrt(1.0 - w**2), -w * np.sqrt(beta)))

    def stretched(theta: Array) -> Array:
        return np.sqrt(beta * np.sin(theta) ** 2 + np.cos(theta) ** 2)

    def raw_g(theta: Array) -> Array:
        return alpha * stretched(theta) + (1.0 - alpha) * np.cos(theta)

    def raw_theta(rho: Array) -> Array:
        square = beta * rho**2
        root = np.sqrt(np.maximum(1.0 - (2.0 * alpha - 1.0) * square, 0.0))
        angle = np.arctan2(rho, (1.0 - alpha**2 * square) / (alpha * root + 1.0 - alpha))
        return np.minimum(angle, theta_max)

    return Lens(
        name=EUCM,
        raw_rho=lambda theta: np.sin(theta) / raw_g(theta),
        raw_slope=lambda theta: (alpha * np.cos(theta) / stretched(theta) + 1.0 - alpha) / raw_g(theta) ** 2,
        raw_g=raw_g,
        raw_theta=raw_theta,
        theta_max=theta_max,
        includes_max=alpha > 0.5,
        rho_max=1.0 / np.sqrt(beta * (2.0 * alpha - 1.0)) if alpha > 0.5 else np.inf,
    )


@functools.lru_cache(maxsize=256)
def double_sphere(coefficients: tuple[float, ...]) -> Lens:
    """rho = sin(theta) / (alpha d + (1 - alpha) k), k = xi + cos(theta), d = sqrt(sin^2(theta) + k^2).

    Near the axis rho is theta / (1 + xi): the model's focal length is not that of the lens. The image ends where it
    turns back, or reaches infinity, k = -w d, up to where the paper's formula for rays goes. The paper's bound for
    projection, w2, is another angle unless xi is 0 or alpha 1/2; for xi below 0 it can lie beyond the pole.

    Raises:
        ValueError: not two coefficients, xi not between -1 and 1, or alpha outside 0 to 1.
    Source:
        Usenko, Demmel and Cremers 2018, "The double sphere camera model", equations 40 to 50.
    """
    _require(DOUBLE_SPHERE, coefficients)
    xi, alpha = coefficients
    if not -1.0 < xi < 1.0 or not 0.0 <= alpha <= 1.0:
        raise ValueError(
            f"lens 'double_sphere' has xi {xi} and alpha {alpha}; xi must lie between -1 and 1, alpha in 0 to 1"
        )
    w = min(alpha, 1.0 - alpha) / max(alpha, 1.0 - alpha)  # the image ends where k = -w d
    cosine_at_end = -xi - w * (np.sqrt(1.0 - xi**2 * (1.0 - w**2)) - xi * w)
    theta_max = float(np.arccos(np.clip(cosine_at_end, -1.0, 1.0)))

    def second_sphere(theta: Array) -> tuple[Array, Array]:
        k = xi + np.cos(theta)
        return k, np.hypot(np.sin(theta), k)

    def raw_g(theta: Array) -> Array:
        k, d = second_sphere(theta)
        return alpha * d + (1.0 - alpha) * k

    def raw_slope(theta: Array) -> Array:
        k, d = second_sphere(theta)
        return (1.0 + xi * np.cos(theta)) * (alpha * k / d + 1.0 - alpha) / raw_g(theta) ** 2

    def raw_theta(rho: Array) -> Array:
        root = np.sqrt(np.maximum(1.0 - (2.0 * alpha - 1.0) * rho**2, 0.0))
        z = (1.0 - alpha**2 * rho**2) / (alpha * root + 1.0 - alpha)
        length = (z * xi + np.sqrt(z**2 + (1.0 - xi**2) * rho**2)) / (z**2 + rho**2)
        return np.minimum(np.arctan2(length * rho, length * z - xi), theta_max)

    return Lens(
        name=DOUBLE_SPHERE,
        raw_rho=lambda theta: np.sin(theta) / raw_g(theta),
        raw_slope=raw_slope,
        raw_g=raw_g,
        raw_theta=raw_theta,
        theta_max=theta_max,
        includes_max=alpha > 0.5,
        rho_max=1.0 / np.sqrt(2.0 * alpha - 1.0) if alpha > 0.5 else np.inf,
    )


def _require(name: str, coefficients: tuple[float, ...]) -> None:
    """Refuse another number of coefficients, and values that no lens has."""
    names, source = COEFFICIENTS[name]
    if len(coefficients) != len(names) or not np.all(np.abs(coefficients) <= MOST_COEFFICIENT):
        raise ValueError(
            f"lens {name!r} takes {len(names)} finite coefficients {', '.join(names)} up to {MOST_COEFFICIENT:g}, "
            f"got {list(coefficients)}; give them as in {source}"
        )


def _first_turn(rise: np.polynomial.Polynomial) -> float:
    """Where an odd polynomial stops to rise, from its derivative in the square of its argument; inf if nowhere."""
    roots = np.atleast_1d(rise.trim(LEAST_COEFFICIENT).roots())
    turns = [root.real for root in roots if abs(root.imag) < 1e-12 and root.real > 0.0]
    return float(np.sqrt(min(turns))) if turns else np.inf


CALIBRATED = {
    KANNALA_BRANDT: kannala_brandt,
    PINHOLE_RADIAL: pinhole_radial,
    EUCM: eucm,
    DOUBLE_SPHERE: double_sphere,
}

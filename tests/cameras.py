"""Cameras and random problems that several tests share."""

from __future__ import annotations

import numpy as np

from eposit import LENS_NAMES, Camera, Pose

KB = (-0.04, 0.003, -0.0004, 0.00002)
# Barrel and pincushion of a wide pinhole lens, and fish-eye lenses of about 130 degrees; in the order of each lens.
COEFFICIENTS = {
    "kannala_brandt": KB,
    "pinhole_radial": (-0.28, 0.12, 0.02),
    "eucm": (0.6, 1.1),
    "double_sphere": (-0.2, 0.6),
}
PAPER_FISHEYE = {"fx": 552.39, "fy": 552.69, "cx": 782.41, "cy": 613.71}
PAPER_PINHOLE = {"fx": 1378.65, "fy": 1381.37, "cx": 807.41, "cy": 602.47}
# The paper's simulated object, mm.
PAPER_OBJECT = np.array([(0.0, 0.0, 0.0), (200.0, 0.0, 0.0), (0.0, 200.0, 0.0), (0.0, 0.0, -50.0)])
# Radius over focal length, from the textbook and not from eposit; angles in radians.
RADIUS = {
    "perspective": np.tan,
    "stereographic": lambda a: 2 * np.tan(a / 2),
    "equidistance": lambda a: a,
    "equisolid": lambda a: 2 * np.sin(a / 2),
    "orthogonal": np.sin,
    "kannala_brandt": lambda a: a * (1 + KB[0] * a**2 + KB[1] * a**4 + KB[2] * a**6 + KB[3] * a**8),
    "pinhole_radial": lambda a: np.tan(a) * (1 - 0.28 * np.tan(a) ** 2 + 0.12 * np.tan(a) ** 4 + 0.02 * np.tan(a) ** 6),
    "eucm": lambda a: np.sin(a) / (0.6 * np.sqrt(1.1 * np.sin(a) ** 2 + np.cos(a) ** 2) + 0.4 * np.cos(a)),
    "double_sphere": lambda a: (
        np.sin(a) / (0.6 * np.sqrt(np.sin(a) ** 2 + (np.cos(a) - 0.2) ** 2) + 0.4 * (np.cos(a) - 0.2))
    ),
}
PAST_90 = {"stereographic", "equidistance", "equisolid", "kannala_brandt", "eucm", "double_sphere"}
PINHOLES = {"perspective", "pinhole_radial"}


def paper_camera(lens: str) -> Camera:
    """The paper's pinhole or fish-eye intrinsics with a lens law."""
    intrinsics = PAPER_PINHOLE if lens in PINHOLES else PAPER_FISHEYE
    return Camera(lens=lens, **intrinsics, width=1600, height=1200, coefficients=COEFFICIENTS.get(lens, ()))


ALL_CAMERAS = [paper_camera(lens) for lens in LENS_NAMES]


def random_object(rng: np.random.Generator, n: int = 4, condition: float = 20.0) -> np.ndarray:
    """(n, 3) points in a ball of 200 mm about M0, cond(A) below `condition`."""
    while True:
        points = np.vstack((np.zeros(3), rng.normal(size=(n - 1, 3))))
        points *= 200.0 / np.linalg.norm(points, axis=1).max()
        if np.linalg.cond(points[1:]) < condition:
            return points


def random_pose(rng: np.random.Generator, points: np.ndarray, limit_deg: float, ratio: float) -> Pose:
    """A pose with every point within `limit_deg` of the axis and size over distance of M0 equal to `ratio`."""
    distance = np.linalg.norm(points - points[0], axis=1).max() / ratio
    while True:
        theta, phi = np.deg2rad(rng.uniform(0.0, limit_deg)), rng.uniform(0.0, 2.0 * np.pi)
        direction = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
        pose = Pose(_rotation(rng.normal(size=4)), distance * direction)
        x, y, z = pose.apply(points).T
        if np.degrees(np.arctan2(np.hypot(x, y), z)).max() <= limit_deg:
            return pose


def _rotation(quaternion: np.ndarray) -> np.ndarray:
    """(3, 3) of x, y, z, w, of any length; SciPy's takes ten times as long for a single one."""
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def helix_pose(t: float) -> Pose:
    """The paper's helix at t degrees, seconds."""
    from eposit.pose import rotation_from_euler

    angle = np.deg2rad(45.0 + t)
    position = np.array([100.0 * np.sqrt(2) * np.cos(angle), 100.0 * np.sqrt(2) * np.sin(angle), 2000.0 + 0.25 * t])
    return Pose(rotation_from_euler(np.deg2rad([20.0 + 0.1 * t] * 3)), position)

"""Image points as rays, and as the pinhole points that POSIT and EPOSIT iterate on.

Arrays have the problems last: normalised image points `seen` (n, 2, b), over focal length and from the principal
point; rays (n, 3, b); pinhole images (2, n, b).
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from eposit.camera import Camera

IMAGE_CIRCLE_ALLOWANCE = 0.01  # image points this fraction outside the lens's image circle are noise, not errors


def unit_rays(camera: Camera, seen: Array) -> Array:
    """`Camera.bearing` of normalised points; NaN where no ray reaches the point."""
    rays = np.empty((len(seen), 3, seen.shape[-1]))
    square = np.einsum("nab,nab->nb", seen, seen)
    if camera.lens == "perspective":  # the same without its trigonometry: (x, y, 1) over its length
        np.divide(1.0, np.sqrt(1.0 + square), out=rays[:, 2])
        np.multiply(seen, rays[:, None, 2], out=rays[:, :2])
        return rays
    radius = np.sqrt(square)
    theta = camera.law.theta(radius)
    on_axis = radius == 0.0
    scale = np.where(on_axis, 1.0, np.sin(theta) / np.where(on_axis, 1.0, radius))
    np.multiply(seen, scale[:, None], out=rays[:, :2])
    np.cos(theta, out=rays[:, 2])
    return rays


def onto_image_circle(camera: Camera, seen: Array) -> Array:
    """Points just outside the image circle drawn onto it: near 90 degrees noise alone moves them out."""
    limit = camera.law.rho_max
    if not np.isfinite(limit):
        return seen
    excess = np.hypot(seen[:, 0], seen[:, 1]) / limit
    outside = (excess > 1.0) & (excess <= 1.0 + IMAGE_CIRCLE_ALLOWANCE)
    if not np.any(outside):
        return seen
    return seen * np.where(outside, (1.0 - 1e-12) / np.maximum(excess, 1.0), 1.0)[:, None]


def rectify_rays(rays: Array) -> Array:
    """Pinhole points of rays; NaN at or beyond 90 degrees."""
    z = rays[:, 2]
    depth = z if np.all(z > 0.0) else np.where(z > 0.0, z, np.nan)
    return (rays[:, :2] / depth[:, None]).transpose(1, 0, 2)


def rectify_paper(camera: Camera, seen: Array, theta_centre: tuple[float, float] | None = None) -> Array:
    """x' / (f G) and y' / (f G).

    theta_centre: the point, px, that theta is measured from; the principal point if None. The paper measures
    theta from the image centre and subtracts the principal point from x and y.
    Source:
        Paper, Table I and equations 21 and 22: G(theta) = cos(theta) / g(theta).
    """
    if camera.lens == "perspective":  # G = 1
        return seen.transpose(1, 0, 2)
    x, y = seen[:, 0], seen[:, 1]
    if theta_centre is not None:
        x, y = x - (theta_centre[0] - camera.cx) / camera.fx, y - (theta_centre[1] - camera.cy) / camera.fy
    theta = camera.law.theta(np.sqrt(x * x + y * y))
    theta = np.where(theta < np.pi / 2, theta, np.nan)
    return (seen * (camera.law.g(theta) / np.cos(theta))[:, None]).transpose(1, 0, 2)


def centred_image(rays: Array) -> tuple[Array, Array]:
    """Pinhole points about M0's ray, (2, n, b), and the rotations (3, 3, b) that turn results back."""
    turn = centring_rotations(rays)
    turned = np.einsum("ijb,njb->nib", turn, rays)
    turned[0] = np.array([[0.0], [0.0], [1.0]])  # M0 by construction; rounding would leave 1e-16
    return rectify_rays(turned), turn.transpose(1, 0, 2)


def centring_rotations(rays: Array) -> Array:
    """(3, 3, b) shortest rotations that carry M0's ray, the first, onto the z axis."""
    x, y, z = rays[0]
    backward = z < -0.5  # the shortest rotation is ill-conditioned near -z: first turn half a revolution about x
    flip = np.where(backward, -1.0, 1.0) if np.any(backward) else None
    if flip is not None:
        y, z = flip * y, flip * z
    w = 1.0 / (1.0 + z)
    rotation = np.empty((3, 3, rays.shape[-1]))
    rotation[0, 0], rotation[1, 1], rotation[2, 2] = 1.0 - x * x * w, 1.0 - y * y * w, z
    rotation[0, 1] = rotation[1, 0] = -x * y * w
    rotation[0, 2], rotation[1, 2], rotation[2, 0], rotation[2, 1] = -x, -y, x, y
    if flip is not None:
        rotation[:, 1:] *= flip
    return rotation

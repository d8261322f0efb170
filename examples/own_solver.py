"""A solver of your own for `--solver examples.own_solver:solve`: here OpenCV's SQPNP on rectified rays."""

import cv2
import numpy as np

import eposit


def solve(points_in_obj, points_px, camera, *, sigma_px=None):
    """(n, 3) object points, mm, and (n, 2) image points, px, to (R, t) of cam_from_obj; None for a failure."""
    rays = camera.bearing(points_px)
    if not np.all(rays[:, 2] > 0):
        return None  # a pinhole cannot see what a fish-eye sees at 90 degrees
    seen = rays[:, :2] / rays[:, 2:]
    found, vector, t = cv2.solvePnP(points_in_obj, seen, np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP)
    return (cv2.Rodrigues(vector)[0], t) if found else None


if __name__ == "__main__":
    CAMERA = eposit.Camera(lens="stereographic", fx=552.4, fy=552.7, cx=782.4, cy=613.7, width=1600, height=1200)
    POINTS_MM = np.array([(0.0, 0, 0), (200, 0, 0), (0, 200, 0), (200, 200, -50)])
    R, t = solve(POINTS_MM, CAMERA.project(POINTS_MM + (100, 100, 2000)), CAMERA)
    print("t, mm:", t.ravel().round(3))

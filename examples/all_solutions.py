"""Four points in a plane, seen from afar, have two poses that fit almost equally well: OPnP lists all solutions."""

import numpy as np

import eposit
import eposit.opnp
from eposit.pose import rotation_from_euler

CAMERA = eposit.Camera(lens="perspective", fx=1378.7, fy=1381.4, cx=807.4, cy=602.5, width=1600, height=1200)
SQUARE_MM = np.array([(0.0, 0, 0), (100, 0, 0), (100, 100, 0), (0, 100, 0)])
TRUTH = eposit.Pose(rotation_from_euler(np.deg2rad([25.0, -10.0, 0.0])), np.array([0.0, 0.0, 2500.0]))

pixels = CAMERA.project(TRUTH.apply(SQUARE_MM)) + np.random.default_rng(3).normal(scale=0.1, size=(4, 2))
solution = eposit.opnp.solve(SQUARE_MM, pixels, CAMERA)
poses, costs = solution.candidates.poses, solution.candidates.cost
print(f"status {solution.status}, {len(costs)} real solutions; the cost of each, relative to the lowest, and its tilt:")
for R, t, cost in zip(poses.R, poses.t, costs, strict=True):
    side = "in front" if np.all(eposit.Pose(R, t).apply(SQUARE_MM)[:, 2] > 0) else "behind the camera"
    print(f"{cost / costs[0]:12.1f}   {np.rad2deg(np.arccos(R[2, 2])):6.1f} degrees, {side}")

"""A thousand noisy images of one object in one call, and whether the stated uncertainty is true."""

import numpy as np

import eposit

CAMERA = eposit.Camera(lens="orthogonal", fx=552.4, fy=552.7, cx=782.4, cy=613.7, width=1600, height=1200)
POINTS_MM = np.array([(0.0, 0, 0), (200, 0, 0), (0, 200, 0), (200, 200, 0), (100, 100, -80), (50, 150, -40)])
TRUTH_MM, SIGMA_PX = np.array([150.0, -80.0, 1200.0]), 0.2

exact = CAMERA.project(POINTS_MM + TRUTH_MM)
images = exact + np.random.default_rng(0).normal(scale=SIGMA_PX, size=(1000, *exact.shape))
solution = eposit.solve(POINTS_MM, images, CAMERA, sigma_px=SIGMA_PX)

solved = solution.status == "ok"
errors = solution.cam_from_obj.t[solved] - TRUTH_MM
stated = np.sqrt(solution.covariance[solved][:, [3, 4, 5], [3, 4, 5]].mean(axis=0))
print(f"solved: {solved.sum()} of {len(images)}")
print("scatter of the position, mm:", errors.std(axis=0).round(2))
print("stated by the covariance:   ", stated.round(2))

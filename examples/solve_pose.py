"""A camera's pose from four points seen by a fish-eye: python examples/solve_pose.py."""

import numpy as np

import eposit

CAMERA = eposit.Camera(lens="equisolid", fx=552.4, fy=552.7, cx=782.4, cy=613.7, width=1600, height=1200)
POINTS_MM = np.array([(0.0, 0, 0), (200, 0, 0), (0, 200, 0), (0, 0, -50)])  # in the object's frame
PIXELS = np.array([(819.17, 650.59), (885.01, 654.43), (808.81, 718.73), (824.68, 655.40)])  # where they are seen

solution = eposit.solve(POINTS_MM, PIXELS, CAMERA, sigma_px=0.4)
if solution.status != "ok":
    raise SystemExit(f"no pose: {solution.status}")
deviation = np.sqrt(np.diag(solution.covariance))
print("position of the object in the camera's frame, mm:", solution.cam_from_obj.t.round(1))
print("standard deviation, mm:                          ", deviation[3:].round(1))
print("rotation, quaternion w x y z:                    ", solution.cam_from_obj.quaternion.round(4))
print("standard deviation, degrees:                     ", np.rad2deg(deviation[:3]).round(2))
print("position of the camera in the object's frame, mm:", solution.cam_from_obj.inverse().t.round(1))

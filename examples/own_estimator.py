"""A system of your own for `--estimator examples.own_estimator:estimate`: here OpenCV from the image to the pose."""

import sys

import cv2
import numpy as np


def estimate(image, camera, target):
    """A picture (uint8, height by width), its camera and the board to (R, t) of cam_from_obj, mm; None: not found."""
    found, corners = cv2.findChessboardCorners(image, target.inner)
    if not found:
        return None
    rays = camera.bearing(corners.reshape(-1, 2))
    _, vector, t = cv2.solvePnP(target.corners, rays[:, :2] / rays[:, 2:], np.eye(3), None)
    return cv2.Rodrigues(vector)[0], t


if __name__ == "__main__":  # on the first picture of a dataset: python examples/own_estimator.py out/demo
    from pathlib import Path

    from datasets.rows import camera_of
    from datasets.store.dataset import open_dataset

    dataset = open_dataset(Path(sys.argv[1]))
    row = dataset.read("frames").slice(0, 1).to_pylist()[0]
    picture = cv2.imdecode(np.frombuffer(row["image"]["bytes"], np.uint8), cv2.IMREAD_GRAYSCALE)
    R, t = estimate(picture, camera_of(row), dataset.recipe.target)
    print("t, mm:", t.ravel().round(1), "truth:", [round(row[f"t_{axis}_mm"], 1) for axis in "xyz"])

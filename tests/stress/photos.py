"""Photographs of chessboards: OpenCV's calibration on our corners and on its own, residuals side by side.

`python -m tests.stress.photos FOLDER` reads FOLDER/sets.toml, a table for each subfolder of pictures from one camera:

    [left]
    squares = [10, 7]
    lens = "pinhole"      # or "fisheye"

There is no truth in a photograph; but wrong corners, and corners placed less exactly, leave a larger residual.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from pathlib import Path

import cv2
import numpy as np

from pipelines.machine import facts
from tests.stress.answers import DETECTORS, OURS
from tests.stress.boards import Board
from tests.stress.measures import AMBIGUOUS, OK
from tests.stress.running import children

STARTS = (0.2, 0.3, 0.4, 0.55)  # focal lengths in picture widths from which a fish-eye lens is calibrated
LEAST_SHARE = 0.5  # of a board's corners with which its picture goes into the calibration
COLUMNS = ["set", "pictures", "found: ours, classic, sector", "corners of ours", "refused by ours, found by OpenCV",
           "pictures all found", "RMS ours", "RMS classic", "RMS sector", "slowest of ours, s"]  # fmt: skip
HEAD = """\
# Photographs of chessboards

Public sets of calibration pictures, each from one camera, that are not in this repository; names of pictures are those
of the sets. OpenCV's own calibration (`calibrateCamera`, `fisheye.calibrate`) is fitted to each detector's corners,
those that ours calls `ok` in the pictures that all three found; RMS is the residual of a coordinate, px. *classic* is
`findChessboardCorners` with `cornerSubPix`, *sector* is `findChessboardCornersSB` (exhaustive, accurate). *corners of
ours*: share of a found board's corners. There is no truth in a photograph; but wrong corners, and corners placed less
exactly, leave a larger residual. Seconds are processor time.

`python -m tests.stress.photos FOLDER --page docs/evidence/photos.md` writes this page; FOLDER/sets.toml names lens and
squares of each set. Asked is: no picture refused that OpenCV finds, and the lowest residual in every set."""


def main():
    """0 if ours refuses no picture that OpenCV takes and has the lowest residual in every set."""
    parser = argparse.ArgumentParser(prog="python -m tests.stress.photos", description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", help="sets; all of them without it")
    parser.add_argument("--limit", type=int, default=1000, help="pictures of each set, evenly chosen")
    parser.add_argument("--page", type=Path, help="file for the table")
    given = parser.parse_args()
    sets, asked, held = tomllib.loads((given.folder / "sets.toml").read_text()), children(), []
    lines = ["| " + " | ".join(COLUMNS) + " |", "|" + " --- |" * len(COLUMNS)]
    print("\n".join(lines))
    try:
        for name in given.only or sets:
            row, holds = _set_row(name, given.folder / name, sets[name], asked, given.limit)
            lines.append("| " + " | ".join(map(str, row)) + " |")
            print(lines[-1], flush=True)
            held.append(holds)
            if given.page:
                _write(given.page, lines, held)
    finally:
        for child in asked.values():
            child.close()
    return int(not all(held))


def _write(page, lines, held):
    """The page of the sets that are done."""
    known = dict(facts())
    versions = ", ".join(f"{name} {known[name]}" for name in ("python", "numpy", "opencv-python-headless", "numba"))
    made = f"Made on {known['date']}, on a machine that other work shared: {known['processor']}; {versions}."
    said = f"{sum(held)} of {len(held)} sets hold everything that is asked."
    page.write_text("\n\n".join([HEAD, made, said, "\n".join(lines)]) + "\n")


def _set_row(name, folder, about, asked, limit):
    board = Board(columns=about["squares"][0], rows=about["squares"][1], disc=False)
    paths = sorted(path for path in folder.iterdir() if path.is_file())
    paths = [paths[i] for i in np.unique(np.linspace(0, len(paths) - 1, min(limit, len(paths))).astype(int))]
    pictures = {path.name: cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in paths}
    said = {d: {n: asked[d].ask(image, board) for n, image in pictures.items()} for d in DETECTORS}
    corners = {d: {n: _corners(answer) for n, (answer, _) in of.items()} for d, of in said.items()}
    found = {d: {n for n, c in of.items() if np.mean(np.isfinite(c[:, 0])) >= LEAST_SHARE} for d, of in corners.items()}
    refused = sorted(set().union(*(found[d] for d in DETECTORS[1:])) - found[OURS])
    shared = sorted(set.intersection(*found.values()))
    size = next(iter(pictures.values())).shape[::-1]
    of_ours = [corners[OURS][n] for n in shared]
    residuals = [_residual([of[n] for n in shared], of_ours, board, about["lens"], size) for of in corners.values()]
    own = [np.mean(np.isfinite(corners[OURS][n][:, 0])) for n in found[OURS]]
    row = [name, len(paths), ", ".join(str(len(found[d])) for d in DETECTORS), f"{np.mean(own):.3f}" if own else "",
           ", ".join(refused), len(shared), *(f"{value:.4f}" for value in residuals),
           f"{max(seconds for _, seconds in said[OURS].values()):.2f}"]  # fmt: skip
    return row, not refused and not residuals[0] > min(residuals)


def _corners(answer):
    """(n, 2) px, NaN where nothing is told."""
    if answer is None:
        return np.full((1, 2), np.nan)
    told = np.isin(answer.status, [OK, AMBIGUOUS])
    return np.where(told[:, None], answer.points, np.nan)


def _residual(corners, ours, board, lens, size):
    """RMS of a coordinate, px, of one detector's corners at those that ours has, after a calibration on them."""
    if len(corners) < 3:
        return np.nan
    y, x = np.mgrid[0 : board.inner[1], 0 : board.inner[0]]
    plane = np.stack((x.ravel(), y.ravel(), 0.0 * x.ravel()), axis=1)
    good = [np.isfinite(c[:, 0]) & np.isfinite(o[:, 0]) for c, o in zip(corners, ours, strict=True)]
    objects = [plane[g].astype(np.float32)[None] for g in good]
    images = [_upright(c, board)[g].astype(np.float32)[None] for c, g in zip(corners, good, strict=True)]
    if lens == "pinhole":
        return float(cv2.calibrateCamera(objects, images, size, None, None)[0]) / np.sqrt(2.0)
    objects, images = ([a.astype(np.float64) for a in of] for of in (objects, images))
    return min(_fisheye_rms(objects, images, size, size[0] * share) for share in STARTS) / np.sqrt(2.0)


def _fisheye_rms(objects, images, size, focal):
    """OpenCV's root of the mean squared distance, px, from one focal length; infinite where it gives up."""
    flags = cv2.CALIB_RECOMPUTE_EXTRINSIC | cv2.CALIB_FIX_SKEW | cv2.CALIB_USE_INTRINSIC_GUESS
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-8)
    lens = np.array([[focal, 0.0, size[0] / 2.0], [0.0, focal, size[1] / 2.0], [0.0, 0.0, 1.0]]), np.zeros((4, 1))
    try:
        return float(cv2.fisheye.calibrate(objects, images, size, *lens, flags=flags, criteria=stop)[0])
    except cv2.error:
        return np.inf


def _upright(corners, board):
    """Rows turned over where the order is that of a mirror."""
    grid = corners.reshape(board.inner[1], board.inner[0], 2)
    across = np.nanmean(grid[:, -1] - grid[:, 0], axis=0)
    down = np.nanmean(grid[-1] - grid[0], axis=0)
    return (grid if across[0] * down[1] - across[1] * down[0] > 0.0 else grid[::-1]).reshape(-1, 2)


if __name__ == "__main__":
    sys.exit(main())

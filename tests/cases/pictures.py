"""Pictures that once gave no answer, a wrong one, or one after a minute."""

from __future__ import annotations

import time
from collections import Counter

import cv2
import numpy as np

from pipelines.detection import detect_points
from render.targets.chessboard import Chessboard
from render.targets.plain_chessboard import PlainChessboard
from tests.cases.answers import Case, said_by

BOARD = Chessboard()
IDEAL = np.stack(np.meshgrid(199.5 + 100.0 * np.arange(9), 199.5 + 100.0 * np.arange(6)), axis=-1).reshape(-1, 2)
SHARPENED_TRUTH = "C03_sharpened_synthetic_truth.npy"


def plain(columns, rows):
    """A board of which only the squares are known."""
    return PlainChessboard(columns=columns, rows=rows, square_mm=30.0)


def told(folder, name, target, truth=None):
    """What the detection says of one picture, and in how much processor time."""
    image = cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED)
    start = time.process_time()
    found = detect_points(image, target)
    seconds = time.process_time() - start
    corners = slice(0, len(found.status) if truth is None else len(truth))
    counts = ", ".join(f"{n} `{status}`" for status, n in Counter(map(str, found.status[corners])).most_common())
    good = found.status[corners] == "ok"
    if truth is None or not np.any(good):
        return f"{counts}; {seconds:.2f} s"
    error = found.points_px[corners][good] - truth[good]
    rms, largest = np.sqrt(np.mean(error**2)), np.max(np.linalg.norm(error, axis=1))
    return f"{counts}; RMS {rms:.4f} px, largest {largest:.3f} px; {seconds:.2f} s"


def cases(folder):
    """A case for each picture."""

    def case(name, what, before, right, target, truth=None):
        return Case(name, what, before, said_by(lambda: told(folder, name, target, truth)), right)

    def corners_of(name):
        return np.load(folder / name)["uv"] if (folder / name).is_file() else None

    sharpened = np.load(folder / SHARPENED_TRUTH) if (folder / SHARPENED_TRUTH).is_file() else None
    told(folder, "C04_ideal_0.png", BOARD)  # kernels are compiled at first use
    return [
        case("C02_webcam_7x6_squares.png", "photograph, 7 x 6 squares", "all `corners_inconsistent`", "30 corners",
             plain(7, 6)),
        case("C02b_fisheye_8x7_squares.png", "photograph, 8 x 7 squares, sharpened in the camera, a patch hides some",
             "all refused", "42 corners, those under the patch without a place", plain(8, 7)),
        case("C03_sharpened_synthetic.png", "blur 0.3 px, unsharp mask, JPEG", "refused", "the drawn places", BOARD,
             sharpened),
        case("C04_ideal_0.png", "edges on the pixels' borders, no blur", "refused", "199.5 + 100 i", BOARD, IDEAL),
        case("C04_ideal_0.3.png", "the same 0.3 px aside", "up to 0.15 px off", "199.8 + 100 i, one edge at 599.9",
             BOARD, IDEAL + 0.3),
        case("C06_board_10x7_given_as_8x7.png", "8 x 7 squares asked of a board of 10 x 7",
             "`ok`, its origin depends on the picture", "a status: the board goes on", plain(8, 7)),
        case("crop-row_0.png", "a board cut by the border, noise of half a grey level", "more than 60 s",
             "within 2 s; corners in view found", BOARD, corners_of("crop-row_0.npz")),
        case("hang_harsh_equisolid_crop.png", "a harsh picture, cut", "more than 25 s", "within 2 s", BOARD),
        case("slow_occ60_2.png", "a board covered in part", "more than 25 s", "within 2 s", BOARD),
        case("mirror_0.png", "the mirrored picture of a board", "`ok`, 66 px off", "`mirrored`", BOARD),
    ]  # fmt: skip

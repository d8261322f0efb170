"""The paper's experiment: OpenCV's calibration and EPOSIT on 30 pictures, both against each other and the truth."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from rich.console import Console

from datasets.plan import plan
from datasets.recipe.model import load_recipe
from datasets.store.claim import claim
from datasets.store.dataset import Dataset
from eposit import Pose, Status
from eposit.arrays import Array
from pipelines.detection import Detector
from pipelines.engines.local import LocalEngine
from pipelines.machine import provenance
from pipelines.pages.sections import Drawing, Table
from pipelines.paper.claims import PaperSection, judged
from pipelines.paper.experiment import figures
from pipelines.paper.experiment.calibration import AT_ONCE
from pipelines.paper.experiment.claims import STATEMENTS, Experiment, Found
from pipelines.paper.experiment.pictures import (
    HARD,
    MethodResult,
    Pictures,
    by_best,
    by_eposit,
    by_released,
    calibrated,
    estimated,
    read_pictures,
)
from pipelines.paper.experiment.times import PAPER_DETECT_MS, PAPER_SOLVE_MS, Cost, timed

RECIPE = "experiment"
DETECTORS = (Detector.OPENCV_SUBPIX, Detector.EDGE_FIT)  # the first as in the paper
INTRO = (
    "Thirty pictures of the paper's board by an orthogonal fish-eye whose focal length is 2 % from the nominal 543 px "
    "and whose principal point is 15 px from the image centre. EPOSIT assumes the nominal camera; OpenCV calibrates "
    "its own from all pictures. The 11th is steep, the 13th out of focus, the 22nd at the field's edge. The paper has "
    "no truth and takes the calibration for it; here both are compared with the truth."
)


def measure(folder: Path, tell: Callable[[str], None] = lambda _: None) -> PaperSection:
    """Everything, from a dataset in `folder`, which is made or completed first. tell: is given a line at each step.

    Raises:
        UserError: the folder holds something else, or the disk refuses.
    """
    dataset = dataset_in(folder, tell)
    found: dict[str, Found] = {}
    for detector in DETECTORS:
        tell(f"experiment: calibration and EPOSIT on the corners of {detector}")
        found[detector] = compare(read_pictures(dataset, detector))
    tell("experiment: times")
    first = found[DETECTORS[0]]
    return section(found, timed(dataset, first.pictures, DETECTORS))


def dataset_in(folder: Path, tell: Callable[[str], None]) -> Dataset:
    """The pictures with both detectors' points; what is there is not done again."""
    from pipelines.stages import run as stages
    from pipelines.stages.missing import Execution

    recipe, text = load_recipe(RECIPE)
    tell(f"experiment: {len(plan(recipe))} pictures in {folder}")
    execution = Execution(LocalEngine(), Console(quiet=True))
    with claim(folder, recipe, text, provenance=provenance()) as dataset:
        stages.run_generate(dataset, execution)
        for detector in DETECTORS:
            stages.run_detect(dataset, execution, detector)
    return dataset


def compare(pictures: Pictures) -> Found:
    """What every method makes of the pictures."""
    camera, calibration = calibrated(pictures, "calibration")
    try:
        plain: MethodResult | str = calibrated(pictures, "calibration in one call", AT_ONCE)[1]
    except cv2.error as error:
        plain = str(error.err)
    nominal, four = pictures.nominal, pictures.four
    return Found(
        pictures,
        camera,
        calibration=calibration,
        at_once=plain,
        eposit=estimated("EPOSIT, four points", pictures, by_eposit, nominal, four),
        eposit_all=estimated("EPOSIT, all points", pictures, by_eposit, nominal),
        released=estimated("released code, four points", pictures, by_released, nominal, four),
        best_four=estimated("best, four points", pictures, by_best, nominal, four),
        best=estimated("best, all points", pictures, by_best, nominal),
        exact=estimated("best, all points, true camera", pictures, by_best, pictures.true),
    )


def section(found: dict[str, Found], cost: Cost) -> PaperSection:
    """Tables, figures and claims; the first detector's pictures are shown one by one."""
    detector, first = next(iter(found.items()))
    pictures, shown = first.pictures, (first.calibration, first.eposit)
    note = "Dashed: the paper's limits. Shaded: the 11th, 13th and 22nd picture."
    items = (
        _per_picture(first, detector, cost.each_ms),
        *(_summary(item, name) for name, item in found.items()),
        Drawing("Poses by the calibration and by EPOSIT (the paper's figure 8)", figures.poses_figure(pictures, shown)),
        Drawing(
            "EPOSIT against the calibration, and both against the truth (figure 9)",
            figures.differences_figure(pictures, first.eposit, first.calibration), note,
        ),
        Drawing(
            "Reprojection errors (figure 7 b)",
            figures.reprojection_figure(pictures, (first.calibration, first.eposit, first.best)),
        ),
        _times(cost),
    )  # fmt: skip
    return PaperSection("The experiment", INTRO, items, judged(STATEMENTS, Experiment(first, cost)))


def _per_picture(found: Found, detector: str, each_ms: dict[str, Array]) -> Table:
    pictures, truth = found.pictures, found.pictures.cam_from_obj
    rows: list[tuple[str, ...]] = []
    for i, status in enumerate(pictures.status):
        hard = HARD.get(i + 1, "")
        times = [f"{times_ms[i]:.3g}" for times_ms in each_ms.values()]
        row = [f"{i + 1} {hard}".rstrip(), status, *times, _number(found.calibration.used_px[i])]
        for result in (found.eposit, found.eposit_all):
            if result.status[i] != Status.OK:
                row += [result.status[i], "", ""]
                continue
            row += [
                f"{result.used_px[i]:.2f}",
                _triple(result.rotation_rad(found.calibration.cam_from_obj)[i], 3),
                _triple(result.shift_mm(found.calibration.cam_from_obj)[i], 0),
            ]
        row += [_pose_error(result, truth, i) for result in (found.calibration, found.eposit, found.best)]
        rows.append(tuple(row))
    head = ["picture", "detection", *(f"time of {name}, ms" for name in each_ms), "calibration, px"]
    for name in ("EPOSIT 4", "EPOSIT all"):
        head += [f"{name}, px", f"{name} - calibration: rx ry rz, rad", f"{name} - calibration: x y z, mm"]
    head += [f"true error of {name}" for name in ("the calibration", "EPOSIT 4", "best, all points")]
    return Table(
        f"Picture by picture, corners of {detector}", tuple(head), tuple(rows),
        "Reprojection is the root mean square distance over the points used. True errors: angle of rotation in rad, "
        "length of the translation's error in mm. A method without an answer has its status in its row. The paper's "
        f"time with detection is {PAPER_DETECT_MS} ms.",
    )  # fmt: skip


def _summary(found: Found, detector: str) -> Table:
    pictures, ordinary = found.pictures, found.pictures.ordinary
    rows: list[tuple[str, ...]] = []
    for result in found.results:
        turn, shift = result.turn_rad(pictures.cam_from_obj), result.shift_mm(pictures.cam_from_obj)
        there = np.array([status == Status.OK for status in result.status])
        hard = [_pose_error(result, pictures.cam_from_obj, number - 1) for number in HARD]
        rows.append(
            (
                result.name, f"{np.sum(there)} of {len(there)}", _median(turn[ordinary]),
                _triple(np.abs(shift[ordinary][there[ordinary]]), 1), _median(result.used_px[ordinary]),
                _median(result.board_px[ordinary]), *hard,
            )
        )  # fmt: skip
    fx, fy, cx, cy = found.camera.matrix[[0, 1, 0, 1], [0, 1, 2, 2]]
    true = pictures.true
    note = (
        f"f {fx:.2f} and {fy:.2f}, centre {cx:.2f} and {cy:.2f} px by the calibration; "
        f"the truth is {true.fx} and {true.fy}, {true.cx} and {true.cy}."
    )
    if isinstance(found.at_once, str):
        note += f" The calibration in one call ends in an error: {found.at_once}."
    head = (
        "method", "answers", "rotation, rad", "x y z, mm", "reprojection, px", "of all points, px",
        *(f"picture {number}: rotation, rad; translation, mm" for number in HARD),
    )  # fmt: skip
    return Table(
        f"Errors against the truth, medians of the 27 ordinary pictures, corners of {detector}", head, tuple(rows), note
    )


def _times(cost: Cost) -> Table:
    rows = [("EPOSIT, four points", cost.eposit, PAPER_SOLVE_MS), ("released code", cost.released, PAPER_SOLVE_MS)]
    rows += [(f"detection, {name}", time, PAPER_DETECT_MS) for name, time in cost.detection.items()]
    return Table(
        "Time of one picture", ("what", "median, ms", "the paper's, ms", "over the paper's"),
        tuple((name, time.text(3), f"{theirs:g}", f"{time.value / theirs:.2g}") for name, time, theirs in rows),
        "Single calls from Python; the shortest of several for a solve, one for a detection. Each detection's own time "
        "stands in the table picture by picture. The paper's 7.6 ms are for detection and EPOSIT together.",
    )  # fmt: skip


def _pose_error(result: MethodResult, truth: Pose, i: int) -> str:
    if result.status[i] != Status.OK:
        return result.status[i]
    return f"{result.turn_rad(truth)[i]:.2g}; {np.linalg.norm(result.shift_mm(truth)[i]):.2g}"


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "none"


def _median(values: Array) -> str:
    return f"{np.nanmedian(values):.2g}" if np.any(np.isfinite(values)) else "none"


def _triple(values: Array, digits: int) -> str:
    """Three numbers; of (k, 3) their medians."""
    if not values.size:
        return "none"
    shown = np.median(values, axis=0) if values.ndim == 2 else values
    return " ".join(f"{value:.{digits}f}" for value in shown)

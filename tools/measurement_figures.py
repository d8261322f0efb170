"""The text of each measured figure, from what its commands have left."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from pipelines.detection import Detector
from tools.measurement_results import MEANS, Results, circles, largest, pooled, rms, span

OTHER_REGIMES = ("typical", "harsh", "paper")
FINDER = "findChessboardCorners,"
GIVEN_RAYS, OWN_RAYS = "PoseLib p3p on given rays", "PoseLib p3p and its rays"
WIDE_DEG = 75.0


def _datasets() -> Iterator[tuple[str, str]]:
    """Each regime with the dataset of the recipe `accuracy` in it."""
    yield "clean", "accuracy"
    for regime in OTHER_REGIMES:
        yield regime, f"accuracy-{regime}"


def corners(results: Results) -> str:
    """Corners in `clean`, ours and OpenCV's."""
    found, rows = pooled(results.points("accuracy")[0]), results.corner_rows("accuracy")
    sector_based = span((row["rms"] for row in results.corner_rows("accuracy", Detector.OPENCV_SB)), ".2f")
    return (
        f"{rms(found):.4f} px RMS per axis, {len(found)} corners; each lens's means at most "
        f"{largest(rows, *MEANS):.4f} px (along x, y, the radius, the board's x), largest {largest(rows, 'max'):.3f} "
        f"px; OpenCV: {_subpix(results):.3f} px (`opencv-subpix`), {sector_based} px (`opencv-sb`)"
    )


def corners_short(results: Results) -> str:
    """The same for README."""
    return f"{rms(pooled(results.points('accuracy')[0])):.4f} px RMS per axis; OpenCV {_subpix(results):.3f} px at best"


def _subpix(results: Results) -> float:
    return rms(pooled(results.points("accuracy", Detector.OPENCV_SUBPIX)[0]))


def steep_corners(results: Results) -> str:
    """Corners on steep boards, and boards that were not found."""
    rows = results.corner_rows("accuracy-steep")
    frames, boards = (sum(row[name] for row in rows) for name in ("frames", "boards"))
    errors = span((row["rms"] for row in rows), ".3f")
    return f"{errors} px RMS, largest {largest(rows, 'max'):.2f} px; {frames - boards} of {frames} boards not found"


def circle(results: Results) -> str:
    """The circle at 2 m, all fish-eyes together, and at 0.6 m, each by itself."""
    far = rms(circles(*results.points("accuracy"), without="perspective"))
    near = span((row["circle_rms"] for row in results.corner_rows("accuracy-near")), ".3f")
    return f"{far:.3f} px at 2 m, {near} px at 0.6 m"


def wide_corners(results: Results) -> str:
    """Corners far off the axis."""
    rows = results.large_square_rows("wide", WIDE_DEG)
    return f"{span((row['rms'] for row in rows if np.isfinite(row['rms'])), '.3f')} px RMS"


def corners_by_regime(results: Results) -> str:
    """Corners in the regimes other than `clean`."""
    found = ", ".join(f"{rms(pooled(results.points(f'accuracy-{regime}')[0])):.3f}" for regime in OTHER_REGIMES)
    theirs = rms(pooled(results.points("accuracy-paper", Detector.OPENCV_SUBPIX)[0]))
    return f"{found} px RMS (OpenCV in `paper`: {theirs:.2f} px)"


def normalised_corners(results: Results) -> str:
    """Whether corners scatter as their covariances say."""

    def ratio(dataset: str) -> float:
        errors, _ = results.points(dataset)
        values = errors.normalised[:, :-1]
        return rms(values[np.isfinite(values)])

    return span((ratio(dataset) for _, dataset in _datasets()), ".2f")


def normalised_poses(results: Results) -> str:
    """Whether poses scatter as their covariances say."""
    return ", ".join(f"{span(results.pose_errors(dataset), '.2f')} (`{regime}`)" for regime, dataset in _datasets())


def normalised_poses_short(results: Results) -> str:
    """The same for README, all regimes together."""
    return span((value for _, dataset in _datasets() for value in results.pose_errors(dataset)), ".2f")


def rendering(results: Results) -> str:
    """Our render against rays."""
    (pinhole,) = results.ratios("perspective")
    fisheyes = [ratio for lens in ("stereo", "equi", "ortho") for ratio in results.ratios(lens)]
    return f"{span(fisheyes, '.0f')} times faster (fish-eyes), {pinhole:.0f} times (perspective)"


def frame(results: Results) -> str:
    """Our frame against the plain one."""
    (together,) = results.ratios("one frame of each camera")
    return f"{together:.0f} times"


def stages(results: Results) -> str:
    """All stages against rays, in two regimes."""
    clean, typical = (1.0 / results.ratios("all stages", command=command)[0] for command in (0, 1))
    return f"{clean:.2f} of their time in `clean`, {typical:.2f} in `typical`"


def equal_error(results: Results) -> str:
    """The plain script with as many samples as it needs for our errors."""
    (ours,), plain = results.figures("orthogonal: corners, ours"), results.figures("corners, plain script")
    (ratio,) = results.ratios("frame and detection")
    reached = float(plain[-1]["figure"].split()[0]) <= float(ours["figure"].split()[0])
    samples = re.findall(r"\d+", plain[-1]["ours"])[0]
    return (
        f"{'' if reached else 'above '}{ratio:.0f} times: ours {ours['figure']}, "
        f"plain pictures {plain[-1]['figure']} with {samples} samples"
    )


def detection(results: Results) -> str:
    """Our detection against OpenCV's classic finder, on two recipes."""
    shares = (1.0 / results.ratios("one picture of each camera", FINDER, command)[0] for command in (0, 1))
    demo, accuracy = shares
    return f"{demo:.1f} times their time on the clock (`demo`), {accuracy:.1f} times (`accuracy`)"


def solver(results: Results) -> str:
    """Two methods in batches against PoseLib's loop."""

    def told(other: str, form: str) -> list[str]:
        return [format(results.cpu_ratios(f"solve {name}", "batch", other)[0], form) for name in ("best", "eposit")]

    given, own = told(GIVEN_RAYS, ".1f"), told(OWN_RAYS, ".0f")
    return (
        f"{given[0]} times (`best`), {given[1]} times (`eposit`) on given rays; {own[0]} and {own[1]} times where the "
        "loop makes its rays"
    )


def compared_solvers(results: Results) -> str:
    """Times of the paper's compared solvers, all against the same loop, over EPOSIT's."""
    eposit, *others = (
        results.cpu_ratios(name, "batch", GIVEN_RAYS)[0] for name in ("solve eposit", "opnp", "gpnpf", "pnpfr")
    )
    opnp, gpnpf, pnpfr = (eposit / other for other in others)
    return f"OPnP {opnp:.0f}, GPnPf {gpnpf:.0f}, PnPfr {pnpfr:.0f} times as long as EPOSIT"


def single_poses(results: Results) -> str:
    """One call at a time against SQPNP, batches against PoseLib's p3p and polish, and what the first call costs."""

    def told(kind: str, other: str) -> list[str]:
        return [span(results.cpu_ratios(name, kind, other), ".1f") for name in ("best", "eposit")]

    single, batch = told("single call", "OpenCV SQPNP"), told("batch", "PoseLib p3p and polish")
    (ransac,) = results.cpu_ratios("robust", "single call", "OpenCV")
    (imported,), (first,) = results.figures("import eposit"), results.figures("first call of best")
    return (
        f"single calls {single[0]} times (`best`), {single[1]} times (`eposit`) as many as SQPNP; batches {batch[0]} "
        f"and {batch[1]} times as many as p3p and polish; `robust`, half of 54 points wrong, {ransac:.0f} times as "
        f"many as solvePnPRansac; import {imported['figure']} beyond NumPy, first call {first['figure']}, later "
        f"{first['value']}"
    )


def cramer_rao(results: Results) -> str:
    """Smallest and largest share of the bound over the components, pinhole and fish-eye."""
    rows = [row for row in results.paper_rows("paper", "over the Cramer-Rao bound") if row[1] == "default"]
    return span((float(cell.split()[0]) for row in rows for cell in row[2:]), ".2f")


def confidence_regions(results: Results) -> str:
    """How often regions hold the truth."""
    rows = results.paper_rows("paper", "95 % region holds the truth")
    shares = span((float(row[2].split()[0]) for row in rows), ".1f")
    return f"{shares} % (pinhole, fish-eye; 4 and 20 points)"


def wrong_points(results: Results) -> str:
    """How often wrong points are left out."""
    rows = [row for row in results.paper_rows("paper", "Recovered poses") if row[2] != "none"]
    least = min((row[4] for row in rows), key=lambda cell: float(cell.split()[0]))
    return f"{least} of 60 problems recovered in the worst of {len(rows)} cases (95 % interval in brackets)"


def memory(results: Results) -> str:
    """Growth of the resident memory."""
    grown = float(results.figures("resident after")[-1]["value"].split()[0])
    return f"{grown:.0f} MB more"

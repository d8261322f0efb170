"""The measurements that the documents tell, one entry each: a new one is an entry here and `make measurements`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tools import measurement_figures as figures
from tools.measurement_results import Results

OUT = "build/measurements"
RUN = "python -m pipelines "


@dataclass(frozen=True, slots=True)
class Measurement:
    """One row of the page."""

    name: str  # in measurements.json and for `--only`
    what: str  # Markdown
    commands: tuple[str, ...]  # what a reader types, in this order
    figure: Callable[[Results], str] | None = None  # from what the commands leave; None: entered by hand
    readme: Callable[[Results], str] | None = None  # README's shorter figure; a figure by hand has it by hand
    costly: bool = False  # measured only with --all, or where --only names it


def run(recipe: str, regime: str = "") -> str:
    """The command that makes a dataset. Another regime develops the linear light of the first one again."""
    if not regime:
        return f"{RUN}run {recipe} --out {OUT}/{recipe}"
    return f"{RUN}run {recipe} --regime {regime} --out {OUT}/{recipe}-{regime} --reuse {OUT}/{recipe}"


def detect(dataset: str, detector: str) -> str:
    """The command that adds another detector's points."""
    return f"{RUN}detect {OUT}/{dataset} --detector {detector}"


def bench(options: str) -> str:
    """The command that measures part of the benchmark."""
    return f"{RUN}bench {options} --json"


CLEAN = run("accuracy")
REGIMES = tuple(run("accuracy", regime) for regime in figures.OTHER_REGIMES)
PAPER_BEYOND = f"{RUN}paper --only beyond --out {OUT}/paper"
SOLVER_BENCH = bench("--only solver")

MEASUREMENTS = (
    Measurement(
        "corners",
        "corners, regime `clean`, 2 m, tilt to 30 degrees, five lenses",
        (CLEAN, detect("accuracy", "opencv-subpix"), detect("accuracy", "opencv-sb")),
        figures.corners,
        figures.corners_short,
    ),
    Measurement(
        "corners-steep",
        "corners, tilt 45 to 72 degrees, five lenses",
        (run("accuracy-steep"),),
        figures.steep_corners,
    ),
    Measurement(
        "circle",
        "circle centre, fish-eyes, RMS per axis",
        (CLEAN, run("accuracy-near")),
        figures.circle,
    ),
    Measurement(
        "corners-wide",
        "corners to 75 degrees off the axis, local square from 20 px, five lenses",
        (run("wide"),),
        figures.wide_corners,
    ),
    Measurement(
        "corners-regimes",
        "corners in `typical`, `harsh`, `paper`; OpenCV is `opencv-subpix`",
        (CLEAN, *REGIMES, detect("accuracy-paper", "opencv-subpix")),
        figures.corners_by_regime,
    ),
    Measurement(
        "corners-normalised",
        "errors over stated deviations, RMS: corners in the four regimes",
        (CLEAN, *REGIMES),
        figures.normalised_corners,
    ),
    Measurement(
        "poses-normalised",
        "pose errors over stated deviations, RMS, 400 frames, six components",
        (CLEAN, *REGIMES),
        figures.normalised_poses,
        figures.normalised_poses_short,
    ),
    Measurement(
        "lens-dots",
        "dots through each lens to 80 degrees: ring means, a single dot's RMS",
        ("python -m pytest tests/render/pathtraced/test_lens_truth.py",),
    ),
    Measurement(
        "exact-points",
        "exact points to 85 degrees (100 where the lens sees them, 70 for pinhole_radial), 2000 problems a lens",
        ("python -m pytest tests/eposit/test_solver.py",),
    ),
    Measurement(
        "opencv-scatter",
        "OpenCV's corners at 2 m in the regime `paper`, scatter per axis",
        ("python -m pytest tests/render/sensor/test_presets.py",),
    ),
    Measurement(
        "motion-blur",
        "motion blur of 2 to 4 px against 16 renders on the way, RMS",
        ("python -m pytest tests/render/sensor/test_develop.py",),
    ),
    Measurement(
        "cramer-rao",
        "noise of 0.4 px on the paper's helix, median error over that of the Cramer-Rao bound, pinhole and fish-eye, "
        "six components",
        (PAPER_BEYOND,),
        figures.cramer_rao,
        figures.cramer_rao,
    ),
    Measurement(
        "rendering",
        "rendering against 64 primary rays for every pixel of the region",
        (bench("--only render"),),
        figures.rendering,
    ),
    Measurement(
        "frame",
        "frames with detection against plain full frames of 64 samples, five lenses together, one pose",
        (bench("--only frame --poses 1"),),
        figures.frame,
    ),
    Measurement(
        "path-traced",
        "the developed picture against 4096 path-traced rays: any pixel, mean",
        ("python -m pytest -m slow -s tests/render/test_frame.py",),
    ),
    Measurement(
        "blender",
        "Blender's Cycles 5.0.1, 64 rays a pixel, no denoiser, same board, equisolid lens and pose: its full picture "
        "against our frame with detection; against our full picture; its region against ours",
        ("make bench-blender",),
    ),
    Measurement(
        "stages",
        "generate, detect, estimate, score and write against those rays alone",
        (bench("--only stages"), bench("--only stages --regime typical")),
        figures.stages,
    ),
    Measurement(
        "equal-error",
        "frames with detection against plain full frames at equal error of the corners, orthogonal lens",
        (bench("accuracy --only equal"),),
        figures.equal_error,
        costly=True,
    ),
    Measurement(
        "detection",
        "detection against OpenCV's finder and `cornerSubPix`, 20 pictures",
        (bench("--only detection --poses 4"), bench("accuracy --only detection --poses 4")),
        figures.detection,
        costly=True,
    ),
    Measurement(
        "solver",
        "`solve` on four points in batches of 100 000 against PoseLib's p3p in a loop, poses per second (processor)",
        (SOLVER_BENCH,),
        figures.solver,
    ),
    Measurement(
        "compared-solvers",
        "the compared solvers, a pose in a batch, processor time",
        (SOLVER_BENCH,),
        figures.compared_solvers,
    ),
    Measurement(
        "single-poses",
        "one pose a call and in batches on four kinds of object, against OpenCV and PoseLib, processor time; first use",
        (bench("--only poses"),),
        figures.single_poses,
    ),
    Measurement(
        "confidence-regions",
        "95 % regions of `solution.covariance`, 20 000 trials: share that holds the truth",
        (PAPER_BEYOND,),
        figures.confidence_regions,
    ),
    Measurement(
        "wrong-points",
        "one point moved or two exchanged among 8 or more, `robust=True`",
        (PAPER_BEYOND,),
        figures.wrong_points,
    ),
    Measurement(
        "memory",
        "resident memory between frame 200 and frame 2000",
        (bench("--memory 2000"),),
        figures.memory,
        costly=True,
    ),
)

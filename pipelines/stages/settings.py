"""What is estimated: with which solver or system, from which points, with which camera."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any

from datasets.errors import UserError
from datasets.recipe.cameras import assumed_camera
from datasets.rows import camera_of
from eposit import Camera
from pipelines.adapters.registry import check_solver, takes_four
from pipelines.adapters.user import file_name
from pipelines.detection import Detector, takes_target
from pipelines.detection.time_limit import MOST_DETECT_SECONDS
from render.targets.chessboard import Chessboard
from render.targets.kinds import AnyTarget

POINTS = ("detected", "truth", "truth+noise")
DETECTED_BY = "detected-"  # before the name of another detector than ours, in tables
CAMERAS = ("exact", "nominal", "paper")
USES = ("four", "all")


def check_detector(name: str) -> None:
    """Refuse an unknown detector.

    Raises:
        UserError: with the known ones.
    """
    if name not in list(Detector):
        raise UserError(f"unknown detector {name!r}; choose one of {', '.join(Detector)}")


def check_target(detector: str, target: AnyTarget) -> None:
    """Refuse a detector that does not find a kind of target.

    Raises:
        UserError: with those that do.
    """
    if not takes_target(detector, target):
        others = ", ".join(name for name in Detector if takes_target(name, target))
        raise UserError(f"detector {detector!r} does not find the target {target.pattern!r}; choose one of {others}")


def check_detect_seconds(seconds: float) -> None:
    """Refuse a limit that is not usable.

    Raises:
        UserError: with those that are.
    """
    if not 0.0 < seconds <= MOST_DETECT_SECONDS:
        raise UserError(
            f"--detect-seconds {seconds:g}: give seconds of processor time above 0, at most {MOST_DETECT_SECONDS:g}, "
            "as 2"
        )


@dataclass(frozen=True, slots=True)
class Setting:
    """One way to estimate: which solver, from which points, with which camera.

    Raises:
        UserError: an unknown word, or a number out of range.
    """

    solver: Annotated[str, "a name that `find_solver` knows"] = "best"
    points: Annotated[str, "detected, truth or truth+noise"] = "detected"
    camera: Annotated[str, "camera the solver assumes: exact, nominal or paper"] = "exact"
    use: Annotated[str, "object points: four or all"] = "all"
    noise_px: Annotated[float, "standard deviation of truth+noise, px per axis"] = 0.4
    draws: Annotated[int, "draws of truth+noise"] = 5
    detector: Annotated[str, "whose points `detected` are"] = Detector.EDGE_FIT

    def __post_init__(self) -> None:
        for name, allowed in (("points", POINTS), ("camera", CAMERAS), ("use", USES)):
            if getattr(self, name) not in allowed:
                raise UserError(f"unknown {name} {getattr(self, name)!r}; choose one of {', '.join(allowed)}")
        check_solver(self.solver, self.use)
        check_detector(self.detector)
        if not 0.0 < self.noise_px <= 100.0:
            raise UserError(f"noise of {self.noise_px} px is not usable; give --noise-px above 0 and at most 100")
        if not 1 <= self.draws <= 10000:
            raise UserError(f"{self.draws} draws are not usable; give --draws from 1 to 10000")

    @property
    def points_name(self) -> str:
        """Name in tables, with the noise or the detector, unless that is ours."""
        if self.points == "detected" and self.detector != Detector.EDGE_FIT:
            return f"{DETECTED_BY}{self.detector}"
        return f"truth+{self.noise_px:g}px" if self.points == "truth+noise" else self.points

    @property
    def name(self) -> str:
        """Name of the shards."""
        draws = f"-x{self.draws}" if self.points == "truth+noise" else ""
        return f"{file_name(self.solver)}-{self.points_name}{draws}-{self.camera}-{self.use}"


def detector_of(points_name: str) -> str | None:
    """The detector whose points a `Setting.points_name` means; None if they are not detected ones."""
    if points_name == "detected":
        return Detector.EDGE_FIT
    return points_name.removeprefix(DETECTED_BY) if points_name.startswith(DETECTED_BY) else None


IMAGE, ALL = "image", "all"  # points and use of a system that is given the image alone


@dataclass(frozen=True, slots=True)
class System:
    """A system and the camera that it is told, or was.

    Raises:
        UserError: an unknown camera.
    """

    name: str  # package.module:function, or what the user calls it
    camera: str = "exact"  # exact, nominal or paper

    def __post_init__(self) -> None:
        if self.camera not in CAMERAS:
            raise UserError(f"unknown camera {self.camera!r}; choose one of {', '.join(CAMERAS)}")

    @property
    def shard_name(self) -> str:
        """Name of the shards."""
        return f"{file_name(self.name)}-{IMAGE}-{self.camera}-{ALL}"


# What `run` estimates: our solver on detected and on true points, and the paper's way with four points.
RUN_SETTINGS = (
    Setting(),
    Setting(points="truth"),
    Setting(use="four"),
    Setting(solver="eposit", use="four"),
    Setting(solver="eposit", use="four", camera="nominal"),
)


def run_settings(target: AnyTarget) -> list[Setting]:
    """`RUN_SETTINGS`, but for a flat target's four points, from which the paper's way has no pose."""
    return [setting for setting in RUN_SETTINGS if setting.use == ALL or isinstance(target, Chessboard)]


def settings_of(solvers: Iterable[str]) -> list[Setting]:
    """What `run` estimates beside `RUN_SETTINGS` with other solvers: detected and true points.

    Raises:
        UserError: an unknown solver.
    """
    settings: list[Setting] = []
    for name in solvers:
        use = "four" if takes_four(name) else "all"
        settings += [Setting(name, use=use), Setting(name, points="truth", use=use)]
    return settings


def assumed(frame: dict[str, Any], choice: str) -> Camera:
    """The camera that a solver assumes for a row of `frames`.

    exact: the true camera. nominal: nominal focal length, image centre. paper: nominal focal length, the true
    principal point subtracted from x and y; a solver that can takes the image centre inside theta.
    """
    true = camera_of(frame)
    if choice == "exact":
        return true
    nominal = assumed_camera(true, frame["nominal_f_px"])
    return nominal if choice == "nominal" else nominal.replace(cx=true.cx, cy=true.cy)

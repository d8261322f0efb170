"""A user's own systems in a night: functions, and files of poses that another program made."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from datasets.errors import UserError
from datasets.plan import frame_count
from datasets.recipe.model import Recipe
from pipelines.adapters.registry import check_solver, takes_four
from pipelines.adapters.user import is_given
from pipelines.nightly.other_code import CHOOSE_CODE, LIMIT_S, Code, OtherCodeError, freeze
from pipelines.nightly.suites import PINNED, READ, suites
from pipelines.nightly.user_files import UserFiles
from pipelines.stages.import_poses import poses_of
from pipelines.stages.pose_formats import TABLE
from pipelines.stages.settings import Setting, System

REGIME = "{regime}"  # stands for the sensor regime in the name of a file of poses
CODE_OF = "code of "  # before a function's name among a night's data

# argv from 5: the option and the name of a function. The last line of stdout tells its files.
FIND = (
    CHOOSE_CODE
    + """
import dataclasses, json
from pipelines.adapters.registry import find_solver
from pipelines.cli import guarded
from pipelines.nightly.user_files import files_of
from pipelines.stages.estimate_images import find_estimator
option, name = sys.argv[5:7]
if code := guarded(lambda: {"--solver": find_solver, "--estimator": find_estimator}[option](name)):
    sys.exit(code)
print()
print(json.dumps(dataclasses.asdict(files_of(name.partition(":")[0]))))
"""
)


@dataclass(frozen=True, slots=True)
class Function:
    """A user's function. It is called in a process of its own, so that nothing it does there can end the night."""

    what: Setting | System

    @property
    def name(self) -> str:
        """As package.module:function."""
        return self.what.solver if isinstance(self.what, Setting) else self.what.name

    @property
    def option(self) -> str:
        """The option of `estimate` that takes it."""
        return "--solver" if isinstance(self.what, Setting) else "--estimator"

    def run(self, code: Code, folder: Path, workers: int) -> None:
        """Estimate a dataset's poses with it; what it raised first is told on stderr.

        Raises:
            OtherCodeError: it does not import, gives what is no pose, takes too long or ends its process.
        """
        words = ("estimate", folder, self.option, self.name, "--workers", str(workers), "--quiet")
        try:
            sys.stderr.write(code.run(*words))
        except OtherCodeError as error:
            raise OtherCodeError(self.told(error)) from None

    def told(self, error: OtherCodeError) -> str:
        """What went wrong, with the function's name once."""
        named = f"{self.option} {self.name}"
        _, found, rest = str(error).partition(f"error: {named}")
        return named + rest if found else f"{named}: {error}"


@dataclass(frozen=True, slots=True)
class PoseFile:
    """Poses that another program made of the pinned pictures."""

    given: str  # the file's name, with `REGIME` where there are several
    system: System
    form: str = TABLE  # of `pose_formats.FORMATS`

    def path(self, regime: str) -> Path:
        """The file of a sensor regime."""
        return Path(self.given.replace(REGIME, regime))


@dataclass(frozen=True, slots=True)
class Systems:
    """What reads the pictures beside our detector."""

    settings: tuple[Setting, ...]  # ours, and other solvers by name
    functions: tuple[Function, ...] = ()
    files: tuple[PoseFile, ...] = ()
    limit_s: float = LIMIT_S  # that a function may take on one suite


def key_of(setting: Setting) -> str:
    """The name of a setting in tables of measures."""
    return f"{setting.solver} {setting.points_name} {setting.camera} {setting.use}"


def asked(
    recipe: str,
    regimes: Sequence[str],
    functions: tuple[Sequence[str], Sequence[str]],
    poses: tuple[Sequence[str], Sequence[str], str],
    limit_s: float,
) -> Systems:
    """What a night estimates: ours, and what is asked for beside it.

    functions: names of solvers and of estimators. poses: files, their names and their form; they are read once, so
    that a wrong one is told before anything is rendered. limit_s: that a function may take on one suite.

    Raises:
        UserError: an unknown name, not one name for each file, one file for several regimes, or a file that is wrong.
    """
    solvers, estimators = (list(dict.fromkeys(names)) for names in functions)
    for name in solvers:
        check_solver(name, "four")
    settings = [Setting(name, use="four" if takes_four(name) else "all") for name in solvers]
    own: list[Setting | System] = [item for item in settings if is_given(item.solver)]
    own += [System(name) for name in estimators]
    return Systems(
        READ + tuple(item for item in settings if item not in own and item not in READ),
        tuple(Function(item) for item in own),
        _pose_files(*poses, {item.regime: item.recipe for item in suites(PINNED, recipe, regimes)}),
        limit_s,
    )


def _pose_files(
    given: Sequence[str], names: Sequence[str], form: str, recipes: dict[str, Recipe]
) -> tuple[PoseFile, ...]:
    """recipes: the pinned pictures' by sensor regime."""
    if len(given) != len(names) or len(set(names)) != len(names):
        raise UserError("--poses and --name go together; give each file of poses a name of its own")
    if not given and form != TABLE:
        raise UserError("--pose-format goes with --poses; leave it out, or give files of poses")
    found = tuple(PoseFile(file, System(name), form) for file, name in zip(given, names, strict=True))
    for item in found:
        if len(recipes) > 1 and REGIME not in item.given:
            told = f"--poses {item.given} is one file for {len(recipes)} regimes, whose frames have the same numbers"
            raise UserError(f"{told}; write {REGIME} in its name, as poses-{REGIME}.csv, or give one --regime")
        for regime, own in recipes.items():
            poses_of(item.path(regime), item.system, range(frame_count(own)), f"pinned-{regime}", form)
    return found


def find(function: Function, code: Code) -> UserFiles:
    """The files of a function, once it has been imported in a process of its own. code: calls it.

    Raises:
        UserError: it cannot be imported or called.
    """
    try:
        said = code.run_program(FIND, function.option, function.name, what="import").stdout
        found = UserFiles(**json.loads(said.rstrip().rpartition("\n")[2]))
    except OtherCodeError as error:
        raise UserError(function.told(error)) from None
    except (ValueError, TypeError):
        told = "importing it ended its process; mend it, so that it is imported without an effect"
        raise UserError(f"{function.option} {function.name}: {told}") from None
    return dataclasses.replace(found, files=tuple(found.files))


def kept_code(systems: Systems, code: Code) -> dict[str, str]:
    """`CODE_OF` each function to the name of its frozen copy, beside `code`, which calls it.

    What cannot be copied has none.

    Raises:
        UserError: a function cannot be imported or called, or the disk refuses.
    """
    found: dict[str, str] = {}
    for function in systems.functions:
        held = find(function, dataclasses.replace(code, limit_s=systems.limit_s))
        if not held.why_not:
            copy = freeze(code.folder.parent, Path(held.root), [Path(file) for file in held.files])
            found[f"{CODE_OF}{function.name}"] = copy.name
    return found


def frozen_of(data: dict[str, str]) -> Iterator[tuple[str, str]]:
    """Each function of a night's data with the name of its frozen copy."""
    for name, value in data.items():
        if name.startswith(CODE_OF):
            yield name.removeprefix(CODE_OF), value

"""A user's own function, named package.module:function: how it is found, called and understood."""

from __future__ import annotations

import functools
import importlib
import inspect
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from datasets.errors import UserError
from eposit import Camera, Solution, Status
from eposit.arrays import Array
from pipelines.adapters.results import MOST_LETTERS, PoseResult, Solver, checked, gather, pose_result

NAME = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*:[^\W\d]\w*(\.[^\W\d]\w*)*")
SIGMA = "sigma_px"
SOLVER_FORM = f"(points_in_obj, points_px, camera, *, {SIGMA}=None)"
ROTATION_TOLERANCE = 1e-5  # of R^T R - 1; what was computed in single precision is off by some 1e-7
MOST_ITERATIONS = 2**31 - 1  # what the column of a table holds


def is_given(name: str) -> bool:
    """Whether a name has the form package.module:function."""
    return NAME.fullmatch(name) is not None


def file_name(name: str) -> str:
    """The name of a solver or estimator as part of a file's name: no system takes ':' for something else."""
    return name.replace(":", "@")


def load_function(name: str, option: str) -> Callable[..., Any]:
    """The function package.module:function; modules in the current folder are found.

    Raises:
        UserError: a name of another form, or what cannot be imported or called. `option` names it in messages.
    """
    if not is_given(name):
        raise UserError(f"{option} {name!r} is not a function's name; give it as package.module:function")
    module_name, _, path = name.partition(":")
    here = str(Path.cwd())
    if not {"", here} & set(sys.path):
        sys.path.append(here)  # behind a frozen copy of the function, if the path begins with one
    try:
        found_there: Any = importlib.import_module(module_name)
    except MemoryError:
        raise
    except (Exception, SystemExit) as error:
        raise UserError(
            f"{option} {name}: importing {module_name} failed with {_line(error)}; mend it, or run from its folder"
        ) from None
    for part in path.split("."):
        if not hasattr(found_there, part):
            raise UserError(f"{option} {name}: {module_name} has no {path!r}; give a function that it defines")
        found_there = getattr(found_there, part)
    if not callable(found_there):
        raise UserError(f"{option} {name}: {path} is {_kind(found_there)}; it must be a function")
    return found_there


def user_solver(name: str, tell: Callable[[str], None]) -> Solver:
    """A user's function as a solver; it is called once for each image, with arrays of its own.

    tell: called with one line for every image on which it raised an exception or gave what is no pose.

    Raises:
        UserError: a function that cannot be imported, cannot be called so, or whose result cannot be understood.
    """
    function = load_function(name, "--solver")
    takes_sigma = check_call(function, f"--solver {name}", SOLVER_FORM, 3, SIGMA)

    def call(*arguments: Any, **extra: Any) -> PoseResult:
        return attempt(functools.partial(function, *arguments, **extra), f"--solver {name}", tell)

    return as_solver(call, takes_sigma)


def as_solver(call: Callable[..., PoseResult], takes_sigma: bool) -> Solver:
    """What answers for one image, of object points, pixels, camera and perhaps sigma_px, as a solver of many."""

    def solve(
        points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, /, *, sigma_px: ArrayLike | None = None
    ) -> Solution:
        obj, batch, single = checked(points_in_obj, points_px)
        extra = {SIGMA: sigma_px} if takes_sigma else {}
        answers = [call(obj.copy(), image.copy(), camera, **extra) for image in batch]
        return gather(obj, batch, camera, answers, single)

    return solve


def check_call(function: Callable[..., Any], what: str, form: str, count: int, keyword: str = "") -> bool:
    """Whether a function takes `keyword` beside its `count` arguments.

    Raises:
        UserError: it does not take so many arguments, or its answer has to be awaited.
    """
    if inspect.iscoroutinefunction(function):
        raise UserError(f"{what} is an async function; it must be one that gives its answer when it is called")
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        return bool(keyword)  # a compiled function that does not tell
    for extra in ({keyword: None}, {}) if keyword else ({},):
        try:
            signature.bind(*range(count), **extra)
        except TypeError:
            continue
        return bool(extra)
    raise UserError(f"{what} is {signature}; it must take {form}")


def attempt(call: Callable[[], Any], what: str, tell: Callable[[str], None]) -> PoseResult:
    """The answer of one call: an exception, or a pose that is none, is a status and a line for `tell`.

    Raises:
        UserError: a result that cannot be understood, as it would be for every image. `what` names the function.
    """
    try:
        result = call()
    except (Exception, SystemExit) as error:
        tell(_line(error))
        return PoseResult(Status.SOLVER_ERROR)
    answer = _read(result, what)
    fault = _fault(answer) if answer.status == Status.OK else None
    if fault:
        tell(fault)
        return PoseResult(Status.SOLVER_ERROR)
    return answer


def _read(result: Any, what: str) -> PoseResult:
    """None, (R, t), (R, t, status), or an object with `status` and `cam_from_obj` or `R` and `t`."""
    if result is None:
        return PoseResult(Status.NO_SOLUTION)
    return _of_values(result, what) if isinstance(result, tuple | list) else _of_object(result, what)


def _of_values(result: Sequence[Any], what: str) -> PoseResult:
    if len(result) not in (2, 3):
        raise UserError(f"{what} gave {len(result)} values; it must give R and t, or R, t and a status")
    return _answer(result[0], result[1], result[2] if len(result) == 3 else Status.OK, what)


def _of_object(result: Any, what: str) -> PoseResult:
    """An answer with the object's `iterations` and `covariance`, where it has them."""
    pose = getattr(result, "cam_from_obj", result)
    for holder, name in ((result, "status"), (pose, "R"), (pose, "t")):
        if not hasattr(holder, name):
            raise UserError(
                f"{what} gave {_kind(result)} without {name}; it must have status and cam_from_obj, or status, R and t"
            )
    answer = _answer(pose.R, pose.t, result.status, what)
    iterations, covariance = getattr(result, "iterations", None), getattr(result, "covariance", None)
    if answer.status != Status.OK:
        return answer
    count = 0 if iterations is None else _count(iterations, f"{what} gave iterations")
    spread = answer.covariance if covariance is None else _numbers(covariance, (6, 6), f"{what} gave a covariance")
    return PoseResult(answer.status, answer.R, answer.t, count, spread)


def _answer(R: Any, t: Any, status: Any, what: str) -> PoseResult:
    if not _is_status(status):
        raise UserError(f'{what} gave the status {status!r}; it must be a text, "ok" or the reason of a failure')
    if status != Status.OK:
        return PoseResult(str(status)[:MOST_LETTERS].encode("utf-8", "replace").decode())
    if R is None or t is None:
        return PoseResult(Status.NO_SOLUTION)
    rotation = _numbers(R, (3, 3), f"{what} gave R")
    position = np.ravel(t) if isinstance(t, np.ndarray) else t  # OpenCV gives a column
    return PoseResult(Status.OK, rotation, _numbers(position, (3,), f"{what} gave t"))


def _is_status(value: Any) -> bool:
    """Whether a value is a text that says something; ok must be spelt so, or a pose would count as a failure."""
    if not isinstance(value, str) or not value:
        return False
    return value == Status.OK or value.strip().lower() != Status.OK


def _numbers(value: Any, shape: tuple[int, ...], what: str) -> Array:
    try:
        if np.iscomplexobj(value):
            raise TypeError  # their real parts are no answer
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise UserError(f"{what} as {_kind(value)}; it must be numbers of shape {shape}") from None
    if array.shape != shape:
        hint = ", such as cv2.Rodrigues makes of a rotation vector" if shape == (3, 3) and array.size == 3 else ""
        raise UserError(f"{what} of shape {array.shape}; it must be of shape {shape}{hint}")
    return array


def _count(value: Any, what: str) -> int:
    number = float(_numbers(value, (), what))
    if not 0.0 <= number <= MOST_ITERATIONS:
        raise UserError(f"{what} {number:g}; it must be a number from 0 to {MOST_ITERATIONS}")
    return int(number)


def _fault(answer: PoseResult) -> str | None:
    """What is wrong with a pose that is said to be one."""
    if pose_result(answer.R, answer.t).status != Status.OK:
        return "a pose that is not finite or out of all bounds, with the status ok"
    if np.abs(answer.R.T @ answer.R - np.eye(3)).max() > ROTATION_TOLERANCE or np.linalg.det(answer.R) < 0.0:
        return "an R that is no rotation, with the status ok"
    return None


def _kind(value: Any) -> str:
    return f"a {type(value).__name__}"


def _line(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__

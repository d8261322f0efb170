"""Which solver a name means. Nothing of a solver is imported before it is asked for."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

import eposit
from datasets.errors import UserError
from eposit import Camera, Solution
from pipelines.adapters.results import Solver
from pipelines.adapters.user import is_given, load_function, user_solver


@dataclass(frozen=True, slots=True)
class Entry:
    """Where a solver is, and what it takes."""

    function: str  # package.module:function
    points: int | None = None  # the one number of points it takes; None: any from four
    weighted: bool = True  # whether it takes `sigma_px`
    theta_centre: bool = False  # whether it can measure theta from another point than the principal one


SOLVERS: dict[str, Entry] = {
    "opencv-sqpnp": Entry("pipelines.adapters.opencv:sqpnp"),
    "opencv-epnp": Entry("pipelines.adapters.opencv:epnp"),
    "opencv-iterative": Entry("pipelines.adapters.opencv:iterative"),
    "opencv-p3p": Entry("pipelines.adapters.opencv:p3p", points=4),
    "opencv-fisheye": Entry("pipelines.adapters.opencv:fisheye"),
    "poselib-p3p": Entry("pipelines.adapters.poselib:p3p", points=4),
    "poselib-p4pf": Entry("pipelines.adapters.poselib:p4pf", points=4),
    "opnp": Entry("eposit.opnp:solve"),
    "gpnpf": Entry("eposit.gpnpf:solve"),
    "pnpfr": Entry("eposit.pnpfr:solve", points=4),
    "released": Entry("eposit.released:solve", weighted=False, theta_centre=True),
}


def solver_names() -> tuple[str, ...]:
    """Every name that needs no function of the user's."""
    return (*eposit.METHODS, *SOLVERS)


def check_solver(name: str, use: str) -> None:
    """Refuse a name that means no solver, or a solver that cannot take all points; a user's is not imported yet.

    Raises:
        UserError: with what is allowed.
    """
    if name not in solver_names() and not is_given(name):
        known = ", ".join(solver_names())
        raise UserError(f"unknown solver {name!r}; choose one of {known}, or give your own as package.module:function")
    if use != "four" and takes_four(name):
        raise UserError(f"solver {name} takes exactly four points; add --use four")


def takes_four(name: str) -> bool:
    """Whether a solver takes four points and no other number."""
    return name in SOLVERS and SOLVERS[name].points == 4


def takes_theta_centre(name: str) -> bool:
    """Whether a solver has the keyword `theta_centre`."""
    return name == "eposit" or (name in SOLVERS and SOLVERS[name].theta_centre)


def find_solver(name: str, tell: Callable[[str], None] = lambda _: None) -> Solver:
    """The solver behind a name of `solver_names` or a user's package.module:function.

    tell: called with one line for every image on which a user's function raised an exception or gave no pose.

    Raises:
        UserError: an unknown name, or a user's function that cannot be imported or called.
    """
    if name in eposit.METHODS:
        return functools.partial(eposit.solve, method=name)
    if name in SOLVERS:
        function = load_function(SOLVERS[name].function, "--solver")
        return function if SOLVERS[name].weighted else _unweighted(function)
    check_solver(name, "four")
    return user_solver(name, tell)


def _unweighted(function: Callable[..., Solution]) -> Solver:
    def solve(
        points_in_obj: ArrayLike,
        points_px: ArrayLike,
        camera: Camera,
        /,
        *,
        sigma_px: ArrayLike | None = None,
        **options: Any,
    ) -> Solution:
        return function(points_in_obj, points_px, camera, **options)

    return solve

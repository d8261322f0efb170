"""`doctor`: what this machine has, and what is missing, before a night is spent on it."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from pathlib import Path

from pipelines.machine import LIBRARIES, usable_cores, version_of
from render import backend


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that rendering and detection need."""

    name: str
    fine: bool
    found: str  # or what to do


def diagnose() -> list[Check]:
    """Every check; rendering is tried where nothing that it needs is missing."""
    gpu = backend.cuda_present()
    checks = [
        Check("python", True, f"{platform.python_version()} on {platform.system()} {platform.machine()}"),
        *map(_library, LIBRARIES),
        _compiler(),
        Check("CUDA GPU", True, "found; EPOSIT_VARIANT=cuda_ad_rgb renders on it" if gpu else "none; the CPU renders"),
        Check("cores", True, str(usable_cores())),
        _names(),
    ]
    return [*checks, _render()] if all(check.fine for check in checks) else checks


def _library(name: str) -> Check:
    version = version_of(name)
    return Check(name, version is not None, version or "not installed; run `make setup`")


def _compiler() -> Check:
    try:
        library = backend.find_llvm()
    except backend.BackendError as error:
        return Check("LLVM", False, str(error))
    return Check("LLVM", True, f"{backend.llvm_version(library)} ({library.name})")


def _names() -> Check:
    """The names `datasets` and `render` belong to other packages too: ours must be the ones that are imported."""
    import datasets

    ours = Path(__file__).resolve().parents[1]
    if Path(datasets.__file__ or "").resolve().is_relative_to(ours):
        return Check("datasets", True, "from this checkout")
    return Check("datasets", False, f"{datasets.__file__} is another package; use a venv of its own")


def _render() -> Check:
    from datasets.plan import plan
    from datasets.recipe.model import load_recipe
    from render.frame import render_frame

    recipe, _ = load_recipe("smoke")
    frame = plan(recipe)[0]
    try:
        linear = render_frame(recipe.target, recipe.light, frame.camera.true_camera(), frame.cam_from_obj, samples=4)
    except backend.BackendError as error:
        return Check("rendering", False, str(error))
    return Check("rendering", True, f"a region of {linear.region.width} x {linear.region.height} px came out")

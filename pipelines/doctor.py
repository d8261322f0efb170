"""`doctor`: what this machine has, and what is missing, before a night is spent on it."""

from __future__ import annotations

import importlib.metadata
import os
import platform
from pathlib import Path

from render import backend

LIBRARIES = ("numpy", "scipy", "mitsuba", "drjit", "opencv-python-headless", "OpenEXR", "pyarrow")


def diagnose() -> list[tuple[str, bool, str]]:
    """Name, whether it is fine, and what was found, for each thing that rendering and detection need."""
    rows = [("python", True, f"{platform.python_version()} on {platform.system()} {platform.machine()}")]
    rows += [_library(name) for name in LIBRARIES]
    rows.append(_compiler())
    gpu = backend.cuda_present()
    rows.append(("CUDA GPU", True, "found: cuda_ad_mono is used" if gpu else "none: llvm_ad_mono is used"))
    rows.append(("cores", True, str(os.cpu_count())))
    rows.append(_lab())
    if all(fine for _, fine, _ in rows):
        rows.append(_render())
    return rows


def versions() -> str:
    """Libraries and machine in one line."""
    found = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in LIBRARIES)
    system = f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    return f"Python {platform.python_version()}, {found}; {system}"


def _library(name: str) -> tuple[str, bool, str]:
    try:
        return name, True, importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return name, False, "not installed; run `make setup`"


def _compiler() -> tuple[str, bool, str]:
    try:
        library = backend.find_llvm()
    except backend.BackendError as error:
        return "LLVM", False, str(error)
    return "LLVM", True, f"{backend.llvm_version(library)} ({library.name})"


def _lab() -> tuple[str, bool, str]:
    """The names `datasets` and `render` belong to other packages too: ours must be the ones that are imported."""
    import datasets

    ours = Path(__file__).resolve().parents[1]
    fine = Path(datasets.__file__ or "").resolve().is_relative_to(ours)
    return (
        "datasets",
        fine,
        "from this checkout" if fine else f"{datasets.__file__} is another package; use a venv of its own",
    )


def _render() -> tuple[str, bool, str]:
    from datasets.plan import plan
    from datasets.recipe.model import load_recipe
    from render.frame import render_frame

    recipe, _ = load_recipe("smoke")
    frame = plan(recipe)[0]
    try:
        master = render_frame(
            recipe.target, recipe.light, frame.camera.true_camera(), frame.cam_from_obj, samples=4, seed=0
        )
    except backend.BackendError as error:
        return "rendering", False, str(error)
    return "rendering", True, f"a region of {master.region[2]} x {master.region[3]} px came out"

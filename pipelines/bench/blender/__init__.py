"""Our frame against Blender's Cycles: the same board, light, camera and pose, 64 rays for each pixel, no denoiser.

Blender's Python has an environment of its own. It gets a description in a file, builds the scene once, and times every
rendering call itself, so that neither its start nor its files count.
"""

from __future__ import annotations

import functools
import json
import os
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from datasets.errors import UserError
from datasets.plan import Frame
from datasets.recipe.model import Recipe
from pipelines.bench.blender.scene import LENS, description
from pipelines.bench.cases import chosen_frames, corner_errors, linear_of, over_background, rms
from pipelines.bench.frame import frame_of_ours
from pipelines.bench.table import Figure, Row, compared
from pipelines.timing import Times, in_turn, mean_of
from render import backend
from render.frame import LinearImage
from render.region import Image, target_region
from render.targets.image_region import Region

PART = "blender"
SAMPLES = 64
IN_A_ROW = 20  # frames of ours against one of Blender's, which takes seconds
VARIABLE = "EPOSIT_BLENDER"
SCRIPT = Path(__file__).resolve().parent / "script.py"
NO_BPY = 3  # the script's exit code; the script says it too, as Blender's Python has none of our modules
REMEDY = "run `make bench-blender`, which makes an environment with one"


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """Rows for one pose through the recipe's equisolid camera; `poses` does not matter.

    Raises:
        UserError: no Python with Blender's `bpy`, or no equisolid camera.
    """
    python = interpreter()
    frame = _frame(recipe)
    camera, name = frame.camera.true_camera(), frame.camera.name
    region = target_region(recipe.target, camera, frame.cam_from_obj)
    backend.load()
    scene = description(recipe, frame, SAMPLES, backend.jit().thread_count())
    with tempfile.TemporaryDirectory() as folder, cycles(python, scene, Path(folder)) as (blender, version):
        picture = Path(folder) / "region.exr"
        blender.render(region, picture)  # and warms up
        theirs, ours = over_background(recipe, camera, _read(picture), region), linear_of(recipe, frame)
        yield from _checks(recipe, frame, ours, theirs, version)
        frame_of_ours(recipe, frame)
        part, that_part, whole, all_of_it, that_whole = in_turn(
            lambda: mean_of(functools.partial(linear_of, recipe, frame), IN_A_ROW),
            functools.partial(blender.render, region),
            lambda: mean_of(lambda: linear_of(recipe, frame).full(camera), IN_A_ROW),
            lambda: mean_of(functools.partial(frame_of_ours, recipe, frame), IN_A_ROW),
            functools.partial(blender.render, None),
            warm_up=False,
        )
    rays = f"Cycles {version}, {SAMPLES} rays"
    yield compared(PART, f"{name}: render of the region", part, f"the same region, {rays}", that_part)
    yield compared(PART, f"{name}: full picture", whole, f"full picture, {rays}", that_whole)
    yield compared(PART, f"{name}: frame and detection", all_of_it, f"full picture, {rays}", that_whole)


def interpreter() -> str:
    """The Python that has `bpy`, from the environment.

    Raises:
        UserError: none is named.
    """
    python = os.environ.get(VARIABLE)
    if not python:
        raise UserError(f"part {PART!r} needs {VARIABLE}, the path of a Python that has Blender's bpy; {REMEDY}")
    return python


@dataclass(frozen=True, slots=True)
class Cycles:
    """Blender with a scene, waiting for requests."""

    python: str
    process: subprocess.Popen[str]
    log: Path  # what Blender says

    def render(self, region: Region | None, save: Path | None = None) -> Times:
        """Render the region, or the whole picture; Blender's own times.

        save: EXR to write, which does not count.
        """
        assert self.process.stdin
        request = {"region": region, "save": str(save) if save else None}
        print(json.dumps(request), file=self.process.stdin, flush=True)
        times = self.answer()
        if save is not None:
            self.answer()
        return Times(times["wall"], times["cpu"])

    def answer(self) -> dict[str, Any]:
        """The next answer.

        Raises:
            UserError: there is none.
        """
        assert self.process.stdout
        line = self.process.stdout.readline()
        if not line and self.process.wait() == NO_BPY:
            raise UserError(f"{VARIABLE} is {self.python!r}, a Python without Blender's bpy; {REMEDY}")
        try:
            return json.loads(line)
        except ValueError as error:
            said = self.log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
            why = f" ({said[-1]})" if said else ""
            raise UserError(f"{VARIABLE} is {self.python!r}, which does not run Blender{why}; {REMEDY}") from error


@contextmanager
def cycles(python: str, scene: dict[str, Any], folder: Path) -> Iterator[tuple[Cycles, str]]:
    """Blender in a process of its own, which ends with the context, and its version.

    folder: for files that the two share.
    Raises:
        UserError: `python` does not run, or has no `bpy`.
    """
    told, log = folder / "scene.json", folder / "blender.log"
    told.write_text(json.dumps(scene), encoding="utf-8")
    with open(log, "wb") as words:
        try:
            process = subprocess.Popen(
                [python, str(SCRIPT), str(told)],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=words, encoding="utf-8",
            )  # fmt: skip
        except OSError as error:
            raise UserError(f"{VARIABLE} is {python!r}, which cannot be run ({error.strerror}); {REMEDY}") from error
    try:
        blender = Cycles(python, process, log)
        yield blender, blender.answer()["blender"]
    finally:
        process.kill()
        process.communicate()


def _frame(recipe: Recipe) -> Frame:
    """The first frame of the recipe's equisolid camera."""
    for frames in chosen_frames(recipe, 1).values():
        if frames and frames[0].camera.lens == LENS:
            return frames[0]
    raise UserError(f"recipe {recipe.name!r} has no {LENS} camera, which Cycles is compared through; take `demo`")


def _read(path: Path) -> Image:
    """(height, width, 2) radiance and share of hits."""
    import OpenEXR

    with OpenEXR.File(str(path)) as file:
        return np.array(file.channels()["RGBA"].pixels)[..., [0, 3]]


def _checks(recipe: Recipe, frame: Frame, ours: LinearImage, theirs: LinearImage, version: str) -> Iterator[Row]:
    """Whether both show the same: corners against truth, and light."""
    name, rays = frame.camera.name, f"Cycles {version}, {SAMPLES} rays"
    own, that = (rms([corner_errors(recipe, frame, linear)]) for linear in (ours, theirs))
    yield Figure(PART, f"{name}: corners, ours", f"{own:.4f} px RMS", f"corners, {rays}", f"{that:.4f} px RMS")
    light = float(theirs.radiance.mean() / ours.radiance.mean())
    yield Figure(PART, f"{name}: mean light of the region", "1", f"mean light, {rays}", f"{light:.4f}")

"""Whole nights of the product on real pictures, with a fault in the candidate that only this process knows of.

Everything runs that runs in a night: pictures, detection, poses, scores, gates, history. What has been computed for the
same input is not computed again: pictures of a suite, points of a picture, the pose of the same points, and what the
baseline's code reads in a suite, which it does once in a process of its own.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
from contextlib import ExitStack, contextmanager
from pathlib import Path
from unittest import mock

import numpy as np
from rich.console import Console

from datasets.recipe.model import load_recipe
from datasets.rows import decode_image, points_by_frame
from datasets.store.claim import claim
from datasets.store.reuse import share_pictures
from pipelines.engines.local import LocalEngine
from pipelines.nightly import night, reading, suites
from pipelines.nightly.acceptance import accept_baseline
from pipelines.nightly.desk import Request
from pipelines.nightly.gates import speed
from pipelines.nightly.other_code import ROOT
from pipelines.nightly.systems import Systems
from pipelines.stages import detect, estimate
from tests.pipelines.nightly.studies.steps import earlier

POSES = 20
SHARD_FRAMES = 10  # the first shard is what gate `speed` reads, again and again
SEED = 20260504
QUIET = Console(quiet=True, stderr=True)


@dataclasses.dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong with the candidate. Each part is None where nothing is."""

    points: object = None  # (found, camera, truth, rng) to what detection finds
    camera: object = None  # (camera, name) to the camera that the solver assumes
    steps: int = 0  # by which the solver ends early
    slower: float = 0.0  # share by which detection takes longer


class Studio:
    """Where nights run that share what they compute."""

    def __init__(self, folder: Path, poses: int = POSES):
        self.folder, self.poses, self.known, self.solved, self.old = folder, poses, {}, {}, {}
        self.make, self.read_old = suites.Suite.make, reading.Frozen.read
        self.assumed, self.solve_with, self.detect_points = estimate.assumed, estimate.solve_with, detect.detect_points

    def history(self, number):
        """A history whose baseline is this code, on pinned pictures of their own; its folder and its recipe."""
        root = self.folder / f"history-{number}"
        recipe = self.folder / f"nightly-{number}.toml"
        if not recipe.is_file():
            text = load_recipe("nightly")[1].replace("count = 80", f"count = {self.poses}")
            text = text.replace("shard_frames = 20", f"shard_frames = {SHARD_FRAMES}")
            recipe.write_text(text.replace("seed = 20", f"seed = {100 + number}"))
            self.night(number, SEED, without=("fresh", "speed"))
            accept_baseline(root, "latest", "the first", "somebody")
        return root, recipe

    def night(self, number, seed, fault=Fault(), without=("speed",)):
        """Run one night and return it."""
        root, recipe = self.folder / f"history-{number}", self.folder / f"nightly-{number}.toml"
        with self._planted(fault):
            return night.run_night(
                Request(str(recipe), root, ("typical",), seed, Systems(suites.READ), without=without), QUIET
            )

    @contextmanager
    def _planted(self, fault):
        with ExitStack() as stack:
            for place, name, own in (
                (suites.Suite, "make", functools.partialmethod(_made, self)),
                (reading.Frozen, "read", functools.partialmethod(_read_old, self)),
                (detect, "detect_points", functools.partial(self._detect, fault)),
                (estimate, "assumed", functools.partial(self._assumed, fault)),
                (estimate, "solve_with", functools.partial(self._solve, fault)),
                (night, "_pictures", lambda *_: []),  # the page's frames decide nothing
                (speed, "_running", functools.partial(_running, speed._running, fault)),
            ):
                stack.enter_context(mock.patch.object(place, name, own))
            yield

    def note(self, dataset):
        """Camera and true points of every picture, by its content."""
        for path in dataset.shards("frames"):
            truth = points_by_frame(dataset.read_shard(dataset.sibling(path, "keypoints")), dataset.recipe.target)
            for row in dataset.read_shard(path, ["frame_id", "camera_name", "image"]).to_pylist():
                image = decode_image(row["image"], path, row["frame_id"])
                self.known[_key(image)] = [row["camera_name"], truth[row["frame_id"]], None]

    def _detect(self, fault, image, *words):
        key = _key(image)
        known = self.known.setdefault(key, [None, None, None])
        if known[2] is None:
            known[2] = self.detect_points(image, *words)
        if fault.points is None:
            return known[2]
        rng = np.random.default_rng(int.from_bytes(key[:8], "little"))
        return fault.points(known[2], known[0], known[1], rng)

    def _assumed(self, fault, frame, choice):
        camera = self.assumed(frame, choice)
        return camera if fault.camera is None else fault.camera(camera, frame["camera_name"])

    def _solve(self, fault, setting, points_in_obj, batch, frame, sigma_px=None, solver=None):
        camera = estimate.assumed(frame, setting.camera)
        given = np.asarray(np.nan if sigma_px is None else sigma_px, float).tobytes()
        key = setting.name, camera, fault.steps, np.asarray(points_in_obj).tobytes(), batch.tobytes(), given
        if key not in self.solved:
            found = self.solve_with(setting, points_in_obj, batch, frame, sigma_px, solver)
            if fault.steps:
                found = earlier(found, fault.steps, points_in_obj, batch, camera, sigma_px)
            self.solved[key] = found
        return self.solved[key]


def _made(suite, studio, folder, engine, console):
    """The pictures of a suite, made once in the studio and shared with the night's folder."""
    store = studio.folder / "pictures" / hashlib.sha256(suite.text.encode()).hexdigest()[:16]
    is_new = not store.is_dir()
    pictures = studio.make(suite, store, LocalEngine(1), console)
    if is_new:
        studio.note(pictures)
    with claim(folder, suite.recipe, suite.text) as dataset:
        share_pictures(dataset, pictures)
    return dataset


def _read_old(frozen, studio, pictures, *words):
    """What the baseline's code makes of a suite, once."""
    key = suites.pictures_digest(pictures)
    if key not in studio.old:
        studio.old[key] = studio.read_old(frozen, pictures, *words)
    return studio.old[key]


@contextmanager
def _running(real, fault, code, folder, function):
    """The process that is timed; the candidate's goes on after detection until that has taken so much longer."""
    program = speed.PROGRAM
    if fault.slower and code.folder == ROOT:
        longer = f"start + {1.0 + fault.slower} * (time.process_time() - start) if stage == 'detect' else 0.0"
        wait = f"        end = {longer}\n        while time.process_time() < end: pass\n"
        program = program.replace("        spent[stage] =", f"{wait}        spent[stage] =")
    with mock.patch.object(speed, "PROGRAM", program), real(code, folder, function) as process:
        yield process


def _key(image):
    return hashlib.sha256(image.tobytes()).digest()

"""A picture by each method of a world against a plain Mitsuba script that renders the same scene at the same size."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.plan import Frame, plan
from datasets.recipe.model import Recipe, load_recipe
from pipelines.bench import frame as closed_form
from pipelines.bench.table import Figure, Row, compared
from pipelines.timing import in_turn, timed
from render import backend
from render.frame import render_world
from render.hybrid.prepare import baked_light
from render.pathtraced.fisheye import tile_sensor
from render.pathtraced.picture import Viewpoint, prepared
from render.targets.image_region import Region
from render.world import World
from render.world.description import Method

PART = "methods"
RECIPE, LENS = "demo-room", "equisolid"  # the demo's board in a room, 800 x 600 px
RAYS = 16  # for a pixel, of the plain script, and of the method path around the board
Film = NDArray[np.float32]


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """A row for each method; neither the recipe nor `poses` matters. Baking, once a dataset, is told apart."""
    room, _ = load_recipe(RECIPE)
    frame = next(frame for frame in plan(room) if frame.camera.lens == LENS)
    studio = room.model_copy(update={"world": World()})
    yield _row("closed", _ours(studio, frame), "direct", functools.partial(closed_form.plain, studio, frame, RAYS))
    for method in ("hybrid", "path"):
        lit = room.model_copy(update={"world": replace(room.world, method=method, path_samples=RAYS)})
        if method == "hybrid":
            _, times = timed(functools.partial(baked_light, lit.world, frame.world, lit.target, lit.light))
            yield Figure(PART, "hybrid: light baked, once a dataset", f"{times.cpu:.1f} s of processor")
        yield _row(method, _ours(lit, frame), "path", functools.partial(_plain, lit, frame))


def _row(method: Method, ours: Callable[[], object], integrator: str, plain: Callable[[], object]) -> Row:
    own, that = in_turn(ours, plain, repeats=1)
    return compared(PART, f"{method}: full picture", own, f"full picture, Mitsuba {integrator}, {RAYS} rays", that)


def _ours(recipe: Recipe, frame: Frame) -> Callable[[], object]:
    camera = frame.camera.true_camera()
    view = Viewpoint(camera, frame.cam_from_obj, frame.render_seed)
    scenery = recipe.world, frame.world, recipe.target, recipe.light, view
    return lambda: render_world(*scenery, samples=recipe.sample_count(), in_colour=True).full(camera)


def _plain(recipe: Recipe, frame: Frame) -> Film:
    """What a first script does: the whole picture at once, all pixels alike."""
    tracer, _ = prepared(recipe.world, frame.world, recipe.target, recipe.light)
    camera, matrix = frame.camera.true_camera(), tracer.composition.world_from_obj
    whole = Region.whole(camera.width, camera.height)
    sensor = tile_sensor(camera, frame.cam_from_obj, whole, RAYS, matrix)
    with backend.jit().suspend_grad():
        return np.array(tracer.integrator.render(tracer.scene, sensor, seed=0, spp=0))

"""Where our detection finds corners in hybrid pictures of rooms and skies, and what path tracing costs for the same."""

import datetime
import time
from pathlib import Path

import numpy as np
import pytest

from pipelines.detection import detect_points
from pipelines.machine import versions
from render.analytic.image_circle import lens_coverage
from render.colour import luminance
from render.hybrid.pixel_rays import RayCamera
from render.hybrid.prepare import baked_light, hybrid_scene
from render.region import target_region
from render.sensor.develop import SensorModel, develop
from tests.hybrid_scenes import LENSES, LIGHT, TARGET, pose_of, scaled_camera, world_of

PLACE = Path(__file__).parents[3] / "docs" / "evidence" / "corners-in-scenes.md"
CHOSEN = ("room", "sky", "glossy")
TILTS = (15.0, 35.0)
SCALE = 0.6  # of the paper's pictures: 960 x 720, the board 190 px wide
PATH_LENSES, PATH_SAMPLES = ("equisolid",), (8, 32)
MARGIN = 24
BAKE_SAMPLES = 128
RMS_PX, MEAN_PX, GAIN = 0.010, 0.001, 10.0


def detected(radiance, region, camera, cam_from_obj):
    """(n, 2) px errors of the corners in a developed picture; beyond the region it is grey."""
    picture = 0.3 * lens_coverage(camera)
    picture[region.pixels] = luminance(radiance)
    found = detect_points(develop(picture.astype(np.float32), SensorModel(exposure=0.75)), TARGET)
    assert np.all(found.status[:-1] == "ok"), found.status
    return (found.points_px - camera.project(cam_from_obj.apply(TARGET.points)))[:-1]


def timed(make):
    """What it makes and the processor seconds that it took."""
    start = time.process_time()
    made = make()
    return made, time.process_time() - start


def hybrid_errors(scene, lens):
    """(n, 2) px errors over all tilts, and processor seconds for a picture."""
    camera, errors, seconds = scaled_camera(lens, SCALE), [], []
    for tilt in TILTS:
        pose = pose_of(lens, tilt)
        region = target_region(TARGET, camera, pose, MARGIN)
        radiance, taken = timed(lambda p=pose, r=region, t=tilt: scene.region(camera, p, r, cells=64, seed=int(t)))
        errors.append(detected(radiance, region, camera, pose))
        seconds.append(taken)
    return np.concatenate(errors), float(np.min(seconds))


def path_errors(scene, lens, samples):
    """The same by path tracing alone."""
    camera, errors, seconds = scaled_camera(lens, SCALE), [], []
    for tilt in TILTS:
        pose = pose_of(lens, tilt)
        region = target_region(TARGET, camera, pose, MARGIN)
        rows, columns = np.mgrid[region.pixels]
        pixels = (rows * camera.width + columns).ravel().astype(np.uint32)
        rays = RayCamera(camera, pose)
        light, taken = timed(lambda r=rays, p=pixels: scene.traced.everything(r, p, samples, samples))
        radiance = scene.gain * light.reshape(region.height, region.width, 3)
        errors.append(detected(radiance, region, camera, pose))
        seconds.append(taken)
    return np.concatenate(errors), float(np.min(seconds))


def rms(errors):
    return float(np.sqrt(np.mean(errors**2)))


def seconds_at(error, floor, path):
    """Processor seconds of path tracing for an error: its square falls with the number of rays to a floor's.

    path: number of rays, error, seconds, of each measurement. The squares above the floor times the rays are averaged.
    """
    noise2 = np.mean([samples * max(found**2 - floor**2, 0.0) for samples, found, _ in path])
    per_ray = np.mean([seconds / samples for samples, _, seconds in path[-1:]])
    return per_ray * noise2 / max(error**2 - floor**2, 1e-12)


def closed_floor(lens):
    """px error of our detection in pictures without any noise of light."""
    from render.frame import render_frame

    camera, errors = scaled_camera(lens, SCALE), []
    for tilt in TILTS:
        pose = pose_of(lens, tilt)
        region = target_region(TARGET, camera, pose, MARGIN)
        image = render_frame(TARGET, LIGHT, camera, pose, samples=64, region=region)
        errors.append(detected(np.repeat(image.radiance[..., None], 3, axis=2), region, camera, pose))
    return rms(np.concatenate(errors))


@pytest.mark.slow
def test_corners_in_scenes():
    """Writes docs/evidence/corners-in-scenes.md."""
    rows, costs, faults = [], [], []
    for name in CHOSEN:
        world, draw = world_of(name, BAKE_SAMPLES)
        baked, bake_s = timed(lambda w=world, d=draw: baked_light(w, d, TARGET, LIGHT))
        scene = hybrid_scene(world, draw, TARGET, LIGHT, baked)
        for lens in LENSES:
            errors, seconds = hybrid_errors(scene, lens)
            mean, standard = errors.mean(axis=0), errors.std(axis=0) / np.sqrt(len(errors))
            rows.append(
                f"| {name} | {lens} | {len(errors)} | {rms(errors):.4f} | {mean[0]:+.4f} +- {standard[0]:.4f} | "
                f"{mean[1]:+.4f} +- {standard[1]:.4f} | {seconds:.2f} |"
            )
            print(rows[-1], flush=True)
            if rms(errors) > RMS_PX or np.any(np.abs(mean) > MEAN_PX + 3.0 * standard):
                faults.append(rows[-1])
            if lens in PATH_LENSES:
                costs.append(cost_row(name, lens, scene, (rms(errors), seconds, bake_s)))
                print(costs[-1][0], flush=True)
                faults += [costs[-1][0]] if costs[-1][1] < GAIN else []
        PLACE.parent.mkdir(exist_ok=True)
        PLACE.write_text(page(rows, [row for row, _ in costs]))
    assert not faults


def cost_row(name, lens, scene, hybrid):
    """A row of the table of costs, and how many times less hybrid costs."""
    error, seconds, bake_s = hybrid
    floor, path = closed_floor(lens), []
    for samples in PATH_SAMPLES:
        found, taken = path_errors(scene, lens, samples)
        path.append((samples, rms(found), taken))
    equal = seconds_at(max(error, 1.02 * floor), floor, path)
    told = ", ".join(f"{samples} rays {found:.4f} px {taken:.1f} s" for samples, found, taken in path)
    row = f"| {name} | {lens} | {floor:.4f} | {told} | {error:.4f} | {seconds:.2f} | {bake_s:.1f} | {equal:.0f} | "
    return f"{row}{equal / seconds:.0f} |", equal / seconds


def page(rows, costs):
    """The page of evidence."""
    head = "| scene | lens | corners | RMS px | mean x px | mean y px | processor s |\n|---|---|---|---|---|---|---|"
    head_costs = (
        "| scene | lens | detection alone px | path tracing | hybrid px | hybrid s | bake s | path s at equal error | "
        "ratio |\n|---|---|---|---|---|---|---|---|---|"
    )
    return f"""# Corners in scenes

Written by `python -m pytest -m slow tests/pipelines/detection/test_corners_in_scenes.py` on
{datetime.date.today().isoformat()} with {versions()}.

Corners of the paper's board that our detection finds in hybrid pictures of {SCALE * 1600:.0f} x {SCALE * 1200:.0f} px,
against exact projection; two poses a lens; the sensor is clean, white is at 153 grey levels of 255. Times are processor
seconds of both cores for the region around the board.

{head}
{chr(10).join(rows)}

The cost at equal error. The square of path tracing's error falls with the number of rays, down to what detection alone
has in pictures of the closed form. The bake is made once for a dataset and is not part of a picture's time.

{head_costs}
{chr(10).join(costs)}
"""

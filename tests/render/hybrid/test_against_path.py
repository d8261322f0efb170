"""Hybrid pictures against path tracing of the same scene, by class of pixel, five scenes through five lenses."""

import datetime
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipelines.machine import versions
from render.colour import luminance
from render.hybrid.prepare import baker, hybrid_scene
from render.region import target_region
from tests.hybrid_scenes import LENSES, LIGHT, SCENES, TARGET, pose_of, scaled_camera, world_of
from tests.render.hybrid.pixel_classes import pixel_classes

PLACE = Path(__file__).parents[3] / "docs" / "evidence" / "hybrid-against-path.md"
WHITE = 204.0  # grey levels of the board's white
SCALE = 0.2  # of the paper's pictures: 320 x 240, the board 65 px wide, 8000 pixels
BAKES, BAKE_SAMPLES = 4, 128
PATH_BATCHES, PATH_SAMPLES = 4, 64
LEVELS, ERRORS, SHIFT_PX = 0.3, 4.0, 0.01


def pictures(scenes, lens):
    """(b, h, w) and (p, h, w) grey levels, by hybrid with each bake and by path in batches; masks; reflectance."""
    camera, pose = scaled_camera(lens, SCALE), pose_of(lens)
    region = target_region(TARGET, camera, pose)
    hybrid = [scene.region(camera, pose, region, cells=64, seed=100 + i) for i, scene in enumerate(scenes)]
    masks, reflectance = pixel_classes(TARGET, camera, pose, region)
    chosen = np.logical_or.reduce(list(masks.values()))
    frame = scenes[0].frame(camera, pose, 100)
    hidden = frame.hidden(region, chosen)
    traced = []
    for i in range(PATH_BATCHES):
        rays = replace(scenes[0], rays=replace(scenes[0].rays, path=PATH_SAMPLES)).frame(camera, pose, 9000 + i)
        traced.append(scenes[0].gain * rays.front(region, chosen))
    grey = [WHITE * np.stack([luminance(picture) for picture in part]) for part in (hybrid, traced)]
    return *grey, {name: mask & ~hidden for name, mask in masks.items()}, reflectance


def class_row(hybrid, traced, mask):
    """Mean level, mean difference, and its standard errors: of independent pixels, and between bakes."""
    a, b = hybrid[:, mask].astype(float), traced[:, mask].astype(float)
    own = np.sqrt(b.var(axis=0, ddof=1).mean() / b.size + a.var(axis=0, ddof=1).mean() / a.size)
    return b.mean(), a.mean() - b.mean(), own, a.mean(axis=1)


def shifts(hybrid, traced, mask):
    """(2,) px by which edges are displaced along x and y, and standard errors: differences along the gradient."""
    mean = hybrid.mean(axis=0)
    difference = (traced.mean(axis=0) - mean)[mask]
    noise2 = (traced.var(axis=0, ddof=1) / len(traced) + hybrid.var(axis=0, ddof=1) / len(hybrid))[mask]
    found = []
    for slope in np.gradient(mean)[::-1]:
        g = slope[mask]
        found.append((-(g @ difference) / (g @ g), np.sqrt(g**2 @ noise2) / (g @ g)))
    return np.array(found)


@pytest.mark.slow
def test_hybrid_against_path():
    """Writes docs/evidence/hybrid-against-path.md."""
    rows, faults = [], []
    for name in SCENES:
        world, draw = world_of(name, BAKE_SAMPLES)
        first = baker(world, draw, TARGET, LIGHT)
        bakes = [replace(first, seed=first.seed + i).bake(TARGET) for i in range(BAKES)]
        scenes = [hybrid_scene.__wrapped__(world, draw, TARGET, LIGHT, baked) for baked in bakes]
        rows += scene_rows(name, {lens: pictures(scenes, lens) for lens in LENSES}, faults)
        PLACE.parent.mkdir(exist_ok=True)
        PLACE.write_text(page(rows))
    assert not faults


def scene_rows(name, found, faults):
    """Rows of a scene's lenses. faults: gets those that break a bound."""
    rows = []
    measured = {
        (lens, kind): (int(mask.sum()), *class_row(hybrid, traced, mask))
        for lens, (hybrid, traced, masks, _) in found.items()
        for kind, mask in masks.items()
        if mask.sum() >= 5
    }
    for lens, (hybrid, traced, masks, _) in found.items():
        cells = []
        for kind in masks:
            if (lens, kind) not in measured:
                cells.append("")
                continue
            count, level, difference, own, _ = measured[lens, kind]
            # The bakes' scatter, as a share of the level, is that of the class in all lenses.
            spread = np.mean([(m[4].std(ddof=1) / m[1]) ** 2 for (_, k), m in measured.items() if k == kind])
            error = np.sqrt(own**2 + spread * level**2 / BAKES)
            cells.append(f"{difference:+.3f} +- {error:.3f} ({count})")
            if abs(difference) > ERRORS * error or abs(difference) > max(LEVELS, ERRORS * error * (count < 200)):
                faults.append(f"{name} {lens} {kind}: {cells[-1]}")
        (dx, ex), (dy, ey) = shifts(hybrid, traced, masks["edge"])
        cells.append(f"{dx:+.4f} +- {ex:.4f}, {dy:+.4f} +- {ey:.4f}")
        if max(abs(dx) - ERRORS * ex, abs(dy) - ERRORS * ey) > 0.0 or max(abs(dx), abs(dy)) > SHIFT_PX + ERRORS * ex:
            faults.append(f"{name} {lens} shift: {cells[-1]}")
        rows.append(f"| {name} | {lens} | {' | '.join(cells)} |")
        print(rows[-1], flush=True)
    return rows


def page(rows):
    """The page of evidence."""
    return f"""# Hybrid pictures against path tracing

Written by `python -m pytest -m slow tests/render/hybrid/test_against_path.py` on {datetime.date.today().isoformat()}
with {versions()}.

Mean of hybrid less path over a class of pixels, in grey levels of a board whose white is at {WHITE:.0f}, with its
standard error and the number of pixels. Pictures of {SCALE * 1600:.0f} x {SCALE * 1200:.0f} px; path tracing with
{PATH_BATCHES * PATH_SAMPLES} rays a pixel, hybrid with {BAKES} bakes of {BAKE_SAMPLES} rays a texel. The standard error
has the noise of independent pixels and what bakes differ by. Bounds: {ERRORS:g} standard errors, and {LEVELS} levels in
classes of 200 pixels and more. The last column is by how far edges are displaced along x and y, from the differences
along the picture's gradient: an edge in a wrong place, or light that ends before or behind its edge, would show there.
Pixels behind an occluder are path-traced in both and left out.

| scene | lens | white | black | edge | shade | disc | displaced px |
|---|---|---|---|---|---|---|---|
{chr(10).join(rows)}
"""

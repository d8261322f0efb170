"""Light that leaves points of a surface towards given directions, by one reflection and path tracing beyond it.

Mitsuba's path integrator would take the surface's own material. Here the material of the first reflection is given, so
that a white sheet can be asked for in the place of the board, or the board's gloss without its paint, while all later
reflections see the scene as it is. The light is the sum of `direct_light` and `rest_of_light`.

Source:
    Veach and Guibas (1995): multiple importance sampling by the power heuristic, as in Mitsuba's path integrator.
"""

from __future__ import annotations

from typing import Any  # Any: Mitsuba's objects, whose types depend on its variant

from render import backend
from render.device import DeviceFloat, DeviceScene, DeviceSpectrum

NUMBERS = 5  # random numbers in [0, 1) that the first reflection takes


def direct_light(scene: DeviceScene, surface: Any, material: Any, numbers: list[DeviceFloat]) -> DeviceSpectrum:
    """What leaves a surface towards `surface.wi` and came straight from light sources that were chosen at random.

    surface: Mitsuba's surface interaction. material: BSDF of the first reflection. numbers: `NUMBERS` of them.
    """
    mi, dr = backend.load(), backend.jit()
    source, weight = scene.sample_emitter_direction(surface, mi.Point2f(numbers[0], numbers[1]), True)
    value, density = material.eval_pdf(mi.BSDFContext(), surface, surface.to_local(source.d))
    density = dr.select(dr.isfinite(density), density, 0.0)  # NaN below the horizon of a plastic without gloss
    share = dr.select(source.delta, 1.0, _power_share(source.pdf, density))
    return dr.select(source.pdf > 0.0, value * weight * share, 0.0)


def rest_of_light(
    scene: DeviceScene, path: Any, surface: Any, material: Any, numbers: list[DeviceFloat], sampler: Any
) -> DeviceSpectrum:
    """What leaves a surface by directions that the material chose.

    path: the integrator for what comes after the first reflection, its paths one shorter. sampler: its random numbers.
    """
    mi, dr = backend.load(), backend.jit()
    turn, weight = material.sample(mi.BSDFContext(), surface, numbers[2], mi.Point2f(numbers[3], numbers[4]))
    ray = mi.RayDifferential3f(surface.spawn_ray(surface.to_world(turn.wo)))
    hit = scene.ray_intersect(ray)
    source = hit.emitter(scene)
    density = scene.pdf_emitter_direction(surface, mi.DirectionSample3f(scene, hit, surface))  # 0 without a source
    mirror = mi.has_flag(turn.sampled_type, mi.BSDFFlags.Delta)
    share = dr.select(mirror, 1.0, _power_share(turn.pdf, density))
    incoming, _, _ = path.sample(scene, sampler, ray, None, True)
    # The path counts the light source that it hits first in full; `direct_light` has part of that.
    return dr.select(turn.pdf > 0.0, weight * (incoming - source.eval(hit) * (1.0 - share)), 0.0)


def _power_share(own: DeviceFloat, other: DeviceFloat) -> DeviceFloat:
    """Share that one way of sampling has of a contribution, by both densities."""
    dr = backend.jit()
    ratio = dr.select(own > 0.0, other / own, 0.0)  # squares of densities of small lamps overflow
    return dr.select(own > 0.0, 1.0 / (1.0 + ratio * ratio), 0.0)

"""The board's own light: an integrator of primary rays whose shading is a looked-up product, free of noise.

The board carries two textures, reflectance (one sharp texel per square) and shading (a smooth map); their product is
the radiance. `reference_scene` in render.scene is the same board under a real lamp, for Mitsuba's path tracer.
"""

from __future__ import annotations

from typing import Any

INTEGRATOR = "eposit_lookup"


def register_integrator(mi: Any) -> None:
    """Define and register the plugin; the variant is set by then."""
    import drjit as dr

    class Lookup(mi.SamplingIntegrator):
        """Radiance = reflectance x shading, both textures of the emitter-free BSDF of what the ray hits first."""

        def __init__(self, props: Any) -> None:
            super().__init__(props)

        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
            si = scene.ray_intersect(ray, mi.RayFlags.Minimal | mi.RayFlags.UV | mi.RayFlags.ShadingFrame, True, active)
            hit = active & si.is_valid()
            bsdf = si.bsdf()
            front = si.wi.z > 0.0
            reflectance = bsdf.eval_diffuse_reflectance(si, hit)
            shading = si.shape.eval_attribute_1("shading", si, hit)
            return dr.select(hit & front, reflectance * shading, 0.0), hit, []

    mi.register_integrator(INTEGRATOR, lambda props: Lookup(props))

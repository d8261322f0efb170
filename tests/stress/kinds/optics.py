"""Kinds that differ by the lens: blur, motion, steep and far boards."""

from dataclasses import replace

from tests.stress.cameras import camera
from tests.stress.drawing import Spread
from tests.stress.kind import Kind
from tests.stress.views import Framing


def _lens(**changes):
    return lambda scene, rng: replace(scene, lens=replace(scene.lens, **changes))


KINDS = (
    Kind("clean", "blur 0.7 px, no noise", camera=camera(noise=0.0)),
    Kind("plain-noise", "blur 0.7 px, noise of 1 grey value: what every other kind starts from"),
    Kind("blur-0", "no blur but the pixel's own area", spread=Spread()),
    Kind("blur-0.3", "blur 0.3 px", spread=Spread(gaussian=0.3)),
    Kind("blur-1", "blur 1 px", spread=Spread(gaussian=1.0)),
    Kind("blur-2", "blur 2 px", spread=Spread(gaussian=2.0)),
    Kind("blur-4", "blur 4 px", spread=Spread(gaussian=4.0), framing=Framing(least=0.8)),
    Kind("motion", "a straight motion of 6 px", spread=Spread(gaussian=0.6, streak=6.0)),
    Kind("defocus", "a defocus disc of radius 3 px", spread=Spread(gaussian=0.5, disc=3.0)),
    Kind("steep", "tilted by 60 to 72 degrees", framing=Framing(tilt_deg=(60.0, 72.0), least=0.8)),
    Kind(
        "fisheye-rim", "up to 65 degrees off the axis of an equidistance lens",
        framing=Framing(lens="equidistance", off_axis_deg=65.0, least=0.35, most=0.6),
    ),
    Kind("oblong", "oblong pixels, fx over fy 1.45", framing=Framing(aspect=1.0 / 1.45)),
    Kind("rolling-pan", "rolling shutter, the camera pans by 0.05 px a row", scene=_lens(skew=0.05)),
    Kind("rolling-shake", "rolling shutter, the camera shakes by 1 px every 120 rows", scene=_lens(sway=1.0)),
    Kind("interlaced", "odd rows taken later, 0.8 px of motion", fields=0.8),
)  # fmt: skip

"""Kinds that differ by the sensor and by what is done to its picture."""

from tests.stress import cameras as make
from tests.stress.cameras import camera
from tests.stress.drawing import Spread
from tests.stress.kind import Kind
from tests.stress.views import Framing

SHARP = Spread(gaussian=0.3)


def _doubled(points):
    return 2.0 * points + 0.5


KINDS = (
    Kind("read-noise", "noise of 8 grey values", camera=camera(noise=8.0)),
    Kind("strong-noise", "noise of 20 grey values", camera=camera(noise=20.0)),
    Kind("shot-noise", "a full well of 300 electrons", camera=camera(full_well=300.0)),
    Kind("clipped", "black and white both clipped", camera=camera(gain=400.0, offset=-60.0)),
    Kind("gamma", "encoded with gamma 2.2", camera=camera(tone=make.gamma)),
    Kind("unsharp", "sharpened: 1.5 of the difference to a blur of 1 px", camera=camera(after=make.unsharp(1.5, 1.0))),
    Kind("jpeg-95", "JPEG of quality 95", camera=camera(after=make.jpeg(95))),
    Kind("jpeg-70", "JPEG of quality 70", camera=camera(after=make.jpeg(70))),
    Kind("jpeg-30", "JPEG of quality 30", camera=camera(after=make.jpeg(30))),
    Kind("webcam", "blur 0.3 px, gamma, sharpened, JPEG 80", spread=SHARP,
         camera=camera(noise=2.0, tone=make.gamma, after=make.in_turn(make.unsharp(1.0, 1.0), make.jpeg(80)))),
    Kind("phone", "noise 6, bilateral filter, sharpened, gamma, JPEG 85",
         camera=camera(noise=6.0, tone=make.gamma,
                       after=make.in_turn(make.bilateral, make.unsharp(0.8, 1.2), make.jpeg(85)))),
    Kind("median", "median of 3 x 3 pixels", camera=camera(noise=4.0, after=make.median(3))),
    Kind("equalised", "contrast enhanced by tiles", camera=camera(after=make.equalised)),
    Kind("enlarged", "a picture of half the size enlarged", framing=Framing(width=400, height=300, least=0.7),
         camera=camera(after=make.enlarged(2)), shift=_doubled),
    Kind("16-bit", "16 bits", camera=camera(bits=16)),
    Kind("colour", "three channels", camera=camera(after=make.colour)),
    Kind("mosaic", "a Bayer mosaic, its colours interpolated", camera=camera(after=make.mosaic)),
    Kind("mosaic-sharp", "the same with blur 0.3 px", spread=SHARP, camera=camera(after=make.mosaic)),
    Kind("hot-pixels", "one pixel in 500 black or white", camera=camera(after=make.hot_pixels(0.002))),
    Kind("salt-pepper", "one pixel in 50 black or white", camera=camera(after=make.hot_pixels(0.02))),
)  # fmt: skip

"""Kinds that differ by what is in the picture: parts of a board, clutter, sizes, no board at all."""

from tests.stress import surroundings as around
from tests.stress.cameras import camera
from tests.stress.drawing import Spread
from tests.stress.kind import Kind
from tests.stress.views import Framing

LARGE = Framing(width=4000, height=3000, least=0.4)
SQUARES = Framing(width=2400, height=1800, least=0.96, most=0.99, tilt_deg=(0.0, 25.0))

KINDS = (
    Kind("cropped", "a board larger than the picture, up to a third outside", framing=Framing(least=1.05, most=1.35)),
    Kind("cropped-noise", "the same with noise of 4", framing=Framing(least=1.05, most=1.35), camera=camera(noise=4.0)),
    Kind("hand", "an arm over a corner of the board", scene=around.hand(0.3)),
    Kind("wide-hand", "an arm over a third of the board", scene=around.hand(0.6)),
    Kind("finger", "a round thing over one corner", scene=around.finger),
    Kind("stripes", "before stripes of 12 px", scene=around.behind(around.stripes(12.0))),
    Kind("checkers", "before checkers of 16 px", scene=around.behind(around.checkers(16.0))),
    Kind("clutter", "before a cluttered wall", scene=around.cluttered),
    Kind("small", "squares of about 9 px", framing=Framing(least=0.11, most=0.16)),
    Kind("very-small", "squares of about 6 px", framing=Framing(least=0.075, most=0.1)),
    Kind("large-squares", "squares of about 150 px, 4 megapixels", framing=SQUARES, finer=2,
         spread=Spread(gaussian=1.0)),
    Kind("12-megapixels", "12 megapixels, blur 1.5 px", framing=LARGE, spread=Spread(gaussian=1.5), finer=2),
    Kind("12-megapixels-hand", "the same, cluttered and with an arm over a corner", framing=LARGE, finer=2,
         spread=Spread(gaussian=1.5),
         scene=lambda scene, rng: around.hand(0.3)(around.cluttered(scene, rng), rng), views=10),
    Kind("no-board", "noise only", board=None, nothing=True, camera=camera(noise=8.0)),
    Kind("no-board-clutter", "a cluttered wall only", board=None, nothing=True, scene=around.cluttered),
    Kind("no-board-stripes", "stripes only", board=None, nothing=True, scene=around.behind(around.stripes(12.0))),
    Kind("no-board-checkers", "checkers all over the picture", board=None, nothing=True,
         scene=around.behind(around.checkers(40.0))),
    Kind("no-board-24-megapixels", "a cluttered wall, 24 megapixels", board=None, nothing=True,
         framing=Framing(width=6000, height=4000), scene=around.cluttered, finer=2, views=5),
    Kind("no-board-24-megapixels-checkers", "checkers of 80 px all over 24 megapixels", board=None, nothing=True,
         framing=Framing(width=6000, height=4000), scene=around.behind(around.checkers(80.0)), finer=1, views=3),
    Kind("no-board-24-megapixels-halftone", "a halftone screen of 40 px, 24 megapixels", board=None, nothing=True,
         framing=Framing(width=6000, height=4000), scene=around.behind(around.halftone(40.0)), finer=1, views=3),
)  # fmt: skip

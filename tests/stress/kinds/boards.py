"""Kinds that differ by the board: its size, its print, its shape, or that it is not the board asked for."""

from tests.stress import surroundings as around
from tests.stress.boards import Board
from tests.stress.kind import Kind
from tests.stress.kinds.light import blinds
from tests.stress.views import Framing

BEND = 8.0 / (1000.0 * 1000.0)  # 1 / mm for each mm of sag over the board's metre

KINDS = (
    Kind("bent-1", "bent to a cylinder, 1 mm over a metre", board=Board(curvature=BEND)),
    Kind("bent-3", "bent by 3 mm", board=Board(curvature=3.0 * BEND)),
    Kind("bent-10", "bent by 10 mm", board=Board(curvature=10.0 * BEND)),
    Kind("misprint", "printed 1 % too wide", board=Board(stretch=1.01), asked=Board()),
    Kind("ink", "black squares 2 % wider on each side", board=Board(ink=0.02)),
    Kind("ink-thin", "black squares 2 % narrower on each side", board=Board(ink=-0.02)),
    Kind("no-margin", "no margin, before grey", board=Board(margin=0.0)),
    Kind("no-margin-clutter", "no margin, before a cluttered wall", board=Board(margin=0.0),
         scene=around.cluttered),
    Kind("narrow-margin", "a margin of a quarter of a square", board=Board(margin=0.25)),
    Kind("no-disc", "the board without its disc", board=Board(disc=False)),
    Kind("no-disc-even", "8 x 6 squares without a disc", board=Board(columns=8, rows=6, disc=False), any_turn=True),
    Kind("no-disc-odd", "9 x 7 squares without a disc", board=Board(columns=9, rows=7, disc=False), any_turn=True),
    Kind("even", "8 x 6 squares with the disc", board=Board(columns=8, rows=6)),
    Kind("odd", "9 x 7 squares with the disc", board=Board(columns=9, rows=7)),
    Kind("square", "8 x 8 squares with the disc", board=Board(columns=8, rows=8)),
    Kind("3x3", "3 x 3 inner corners, with the disc", board=Board(columns=4, rows=4)),
    Kind("3x3-no-disc", "3 x 3 inner corners, without a disc", board=Board(columns=4, rows=4, disc=False),
         any_turn=True),
    Kind("4x3", "4 x 3 inner corners, without a disc", board=Board(columns=5, rows=4, disc=False)),
    Kind("24x17", "24 x 17 squares", board=Board(columns=24, rows=17), framing=Framing(least=0.8)),
    Kind("mirrored", "the picture of a mirrored board", board=Board(mirrored=True), nothing=True),
    Kind("larger-asked", "10 x 7 squares asked of a board of 8 x 7", board=Board(columns=8), asked=Board(),
         nothing=True),
    Kind("smaller-asked", "8 x 7 squares asked of a board of 10 x 7", asked=Board(columns=8), nothing=True),
    Kind("smaller-asked-2", "10 x 7 squares asked of a board of 13 x 10", board=Board(columns=13, rows=10),
         asked=Board(), nothing=True),
    Kind("blinds-larger", "10 x 7 squares asked of a board of 8 x 7 in stripes of shadow", board=Board(columns=8),
         asked=Board(), light=blinds(0.25), nothing=True),
    Kind("blinds-mirrored", "a mirrored board in stripes of shadow", board=Board(mirrored=True), light=blinds(0.25),
         nothing=True),
)  # fmt: skip

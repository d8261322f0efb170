"""One kind of spoiled picture: what stands there, how light reaches the sensor, what the camera makes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tests.stress.boards import Board
from tests.stress.cameras import camera
from tests.stress.drawing import Spread, draw
from tests.stress.scenes import Scene
from tests.stress.views import Framing, place

SURE_PX = 3.0  # from the border of the picture or of a cover within which a corner counts neither as seen nor as hidden

BOARD, FRAMING, SPREAD, CAMERA = Board(), Framing(), Spread(gaussian=0.7), camera()


@dataclass(frozen=True)
class Shot:
    """One picture and what is true of it."""

    image: np.ndarray
    truth: np.ndarray  # (n + 1, 2) px, inner corners and the disc's centre; NaN without a board
    seen: np.ndarray  # (n + 1,) surely in the picture and free
    hidden: np.ndarray  # (n + 1,) surely not


@dataclass(frozen=True)
class Kind:
    """How twenty pictures are made, and what may be said of them."""

    name: str
    says: str  # for the table
    board: Board | None = BOARD
    asked: Board | None = None  # the board that is looked for, if it is another one
    framing: Framing = FRAMING
    spread: Spread = SPREAD
    scene: Callable = lambda scene, rng: scene
    light: Callable = lambda linear, rng: linear  # smooth, on the picture's own pixels
    camera: Callable = CAMERA
    shift: Callable = lambda points: points  # of the truth, by what the camera does to it
    nothing: bool = False  # no point may be called ok
    any_turn: bool = False  # the board looks the same after half a turn, and nothing else tells
    lost: Callable = lambda scene, points: np.zeros(len(points), bool)  # points that need not be found
    fields: float = 0.0  # px that the picture moves between its even and its odd rows
    finer: int = 4
    views: int = 20

    @property
    def target(self):
        """The board that is looked for."""
        return self.asked or self.board or BOARD

    def shot(self, view):
        """The picture of one view, the same in every run."""
        rng = np.random.default_rng([23, view])
        lens, R, t = place(self.framing, self.board or BOARD, view)
        scene = self.scene(Scene(self.board, lens, R, t), rng)
        size = self.framing.width, self.framing.height
        image = self.camera(self.light(self._linear(scene, size), rng), rng)
        if self.board is None:
            none = np.zeros(0, bool)
            return Shot(image, np.zeros((0, 2)), none, none)
        return Shot(image, self.shift(scene.truth()), *self._seen(scene, size))

    def _linear(self, scene, size):
        """Radiance in each pixel."""
        if not self.fields:
            return draw(scene, *size, self.spread, self.finer)
        halves = (replace(scene, lens=replace(scene.lens, cx=scene.lens.cx + d * self.fields)) for d in (-0.5, 0.5))
        even, odd = (draw(half, *size, self.spread, self.finer) for half in halves)
        even[1::2] = odd[1::2]
        return even

    def _seen(self, scene, size):
        """Which points are surely seen, and which surely hidden, by the border and by covers."""
        points = scene.truth()
        depth = -np.minimum(points + 0.5, np.array(size) - 0.5 - points).min(axis=1)
        for cover in scene.covers:
            if cover.opacity == 1.0:
                depth = np.maximum(depth, cover.depth(*points.T))
        return (depth < -SURE_PX) & ~self.lost(scene, points), depth > SURE_PX

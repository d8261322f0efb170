"""Every compiled function, compiled or loaded before the first picture: a first run then says what it waits for."""

from __future__ import annotations

import numpy as np

from pipelines.detection import circle, circle_model, corner_model, generic_lens


def compile_kernels() -> None:
    """Call each compiled function once, on next to nothing.

    It takes some ten seconds on a machine that has not kept them yet, and a tenth of one where it has.
    """
    lens = np.array([100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    R, t, at = np.eye(3), np.array([0.0, 0.0, 5.0]), np.arange(2.0)
    generic_lens.project(R, t, lens, at, at, 0.0, np.empty((2, 2)))
    generic_lens.slopes(R, t, lens, at, at, np.empty((4, generic_lens.PARAMETERS)))
    generic_lens.meet_planes(R, t, lens, at, at, at, np.empty((2, 2, 2, 2)))
    generic_lens.fit(R, t, lens, at, at, np.zeros((2, 2)), np.ones(2), np.ones(7), 1)
    nothing = corner_model.CornerTask(
        starts=np.empty((0, 2)),
        shapes=np.empty((0, corner_model.SHAPE)),
        bends=np.empty((0, 2)),
        inverses=np.empty((0, 2, 2)),
        reaches=np.empty((0, 2)),
        window=1,
        discs=np.empty((0, 2)),
        disc_axes=np.eye(2),
    )
    corner_model.fit_corners(np.zeros((4, 4), np.uint8), nothing, 1, 0.5)
    circle_model.prepare()
    circle.prepare()

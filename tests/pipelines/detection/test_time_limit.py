"""The last limit on a picture's detection: between steps it ends all, and it is far from ordinary pictures."""

import numpy as np
import pytest

from pipelines.detection import Detector, detect_points, time_limit
from pipelines.detection.circle_grids import find_circle_grid
from pipelines.detection.disc_candidates import levels_of_blobs
from pipelines.detection.time_limit import DETECT_SECONDS, TimeLimit, TooLateError
from render.targets.aprilgrid import AprilGrid
from render.targets.charuco import Charuco
from render.targets.chessboard import Chessboard
from render.targets.circle_grid import CircleGrid
from render.targets.plain_chessboard import PlainChessboard
from tests.drawn_boards import Drawing


class Clock:
    """Processor time that goes on by a step at each look."""

    def __init__(self, step):
        self.now, self.step, self.looks = 0.0, step, 0

    def __call__(self):
        self.looks += 1
        self.now += self.step
        return self.now


@pytest.fixture
def clock(monkeypatch):
    def started(step):
        clock = Clock(step)
        monkeypatch.setattr(time_limit.time, "thread_time", clock)
        return clock

    return started


def test_a_limit_holds_until_it_is_over(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(time_limit.time, "thread_time", lambda: now[0])
    limit = TimeLimit(2.0)
    now[0] = 102.0
    limit.check()
    now[0] = 102.1
    with pytest.raises(TooLateError):
        limit.check()


@pytest.mark.parametrize("detector", [Detector.EDGE_FIT, pytest.param(Detector.OPENCV_SB, marks=pytest.mark.full)])
def test_every_point_of_a_picture_that_takes_too_long_is_too_late(detector, clock):
    """A limit that is over at the first look, and at each later one: the finder's, the fits', the circle's."""
    image, target = Drawing().image(), Chessboard()
    looks = clock(0.0)
    assert "too_late" not in detect_points(image, target, detector, DETECT_SECONDS).status
    for k in range(looks.looks - 1):  # one look tells when it began
        clock(1.0)
        late = detect_points(image, target, detector, k + 0.5)
        assert set(late.status) == {"too_late"}
        assert np.all(np.isnan(late.points_px))
    clock(1.0)
    assert "too_late" not in detect_points(image, target, detector, looks.looks).status


@pytest.mark.parametrize("target", [PlainChessboard(), Charuco(), AprilGrid(), CircleGrid()])
def test_it_is_looked_at_for_printed_boards(target, clock):
    """Markers are read by one call of OpenCV, which is given bounded work; its fits come after it."""
    clock(1.0)
    looks_for_markers = isinstance(target, Charuco | AprilGrid)
    found = detect_points(Drawing(circle=None).image(), target, seconds=0.5)
    assert set(found.status) == {"board_not_found" if looks_for_markers else "too_late"}


def test_it_is_looked_at_for_each_group_of_discs():
    """Waves like those of an egg crate make so many groups at one level that 12 megapixels took 2.5 s."""
    y, x = np.mgrid[0:600, 0:800]
    waves = (127.0 + 100.0 * np.sin(0.4 * x) * np.sin(0.37 * y)).astype(np.uint8)
    looks: list[int] = []
    assert find_circle_grid(waves, CircleGrid(), lambda: looks.append(1)) is None
    assert len(looks) > len(list(levels_of_blobs(waves)))

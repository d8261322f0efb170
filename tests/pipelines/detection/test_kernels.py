"""The bits do not depend on what is compiled, in which order, or loaded."""

import os
import subprocess
import sys

CODE = """
import hashlib, sys
from pipelines.detection import prepare
for index in map(int, sys.argv[1:]):
    prepare.MODULES[index].prepare()
from pipelines.detection import detect_points
from tests.pipelines.detection import test_circle, test_finders

image, _ = test_finders.drawn(26.0, 20.0)
found = detect_points(image, test_finders.TARGET)
assert (found.status[:-1] == "ok").all(), found.status
circle = test_circle.found_in(*test_circle.board_with("tilted"))
digest = hashlib.sha256(found.points_px.tobytes() + found.covariance_px2.tobytes())
digest.update(circle.centre_px.tobytes() + circle.covariance_px2.tobytes())
print(digest.hexdigest())
"""


def digest(cache, *order):
    """Of what a new process finds that first compiles or loads the modules of these numbers, in this order."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, "-c", CODE, *map(str, order)]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout


def test_bits_are_the_same_compiled_in_any_order_and_loaded(tmp_path):
    """Let the compiler reorder sums (`fastmath`), and the three first ones differ from each other by 1e-13 px."""
    found = [digest(tmp_path / "one"), digest(tmp_path / "two", 0, 1, 2, 3), digest(tmp_path / "two")]
    assert any((tmp_path / "one").rglob("*.nbc"))
    assert len(set(found)) == 1

"""The bits do not depend on what is compiled, in which order, or loaded; and compiled functions are always kept."""

import os
import subprocess
import sys

from pipelines.detection.kernels import own_temporary_folder

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


def test_everything_is_compiled_before_the_first_picture():
    code = (
        "import numba.core.event as event\n"
        "from pipelines.detection.prepare import compile_kernels\n"
        "compile_kernels()\n"
        "from pipelines.detection import circle, circle_model, corner_model, generic_lens\n"
        "modules = circle, circle_model, corner_model, generic_lens\n"
        "kernels = {f for m in modules for f in vars(m).values() if hasattr(f, 'signatures')}\n"
        "before = {f: list(f.signatures) for f in kernels}\n"
        "from tests.pipelines.detection import test_circle, test_finders\n"
        "from pipelines.detection import detect_points\n"
        "detect_points(test_finders.drawn(26.0, 20.0)[0], test_finders.TARGET)\n"
        "test_circle.found_in(*test_circle.board_with('tilted'))\n"
        "assert before == {f: list(f.signatures) for f in kernels}\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_where_nothing_can_be_kept_beside_the_source_the_user_has_a_folder(tmp_path, monkeypatch):
    """As another user on a read-only checkout without a home: Numba alone raises `cannot cache function`."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    code = (
        "from numba.core import caching\n"
        "class Nowhere:\n"
        "    @classmethod\n"
        "    def from_function(cls, function, path):\n"
        "        return None\n"
        "caching.CacheImpl._locator_classes = [caching.UserProvidedCacheLocator, Nowhere]\n"
        "from pipelines.detection.kernels import compiled\n"
        "from pipelines.detection.cholesky import solve_damped\n"
        "import numpy as np\n"
        "from pipelines.detection import generic_lens as g\n"
        "g.project(np.eye(3), np.ones(3), np.ones(7), np.ones(1), np.ones(1), 0.0, np.empty((1, 2)))\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    assert list(tmp_path.glob("eposit-kernels-*/**/*.nbc"))


def test_a_folder_of_somebody_else_is_not_used(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    folder = own_temporary_folder()
    assert folder is not None
    assert folder.stat().st_mode & 0o077 == 0
    folder.chmod(0o777)
    assert own_temporary_folder() is None


def test_compiling_is_told_only_where_nothing_was_kept(tmp_path, monkeypatch):
    """A thread's `must_compile` is true with an empty cache, false with a full one; left early, it ends early."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    code = (
        "from pipelines.detection import prepare\n"
        "prepare.MODULES = prepare.MODULES[2:]\n"  # the quickest
        "with prepare.Kernels() as kernels:\n"
        "    print(kernels.must_compile())\n"
        "    kernels.finish()\n"
        "    print(kernels.must_compile())\n"
    )
    command = [sys.executable, "-c", code]
    cold, warm = (subprocess.run(command, capture_output=True, text=True, check=True).stdout for _ in range(2))
    assert cold.split() == ["True", "False"]
    assert warm.split() == ["False", "False"]

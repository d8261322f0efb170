"""Everything is compiled before the first picture, and it is told when something is."""

import subprocess
import sys

import pytest


def test_everything_is_compiled_before_the_first_picture():
    code = (
        "import numba.core.event as event\n"
        "from pipelines.detection.prepare import compile_kernels\n"
        "compile_kernels()\n"
        "from pipelines.detection import prepare\n"
        "kernels = {f for m in prepare.MODULES for f in vars(m).values() if hasattr(f, 'signatures')}\n"
        "before = {f: list(f.signatures) for f in kernels}\n"
        "from tests.pipelines.detection import test_circle, test_finders\n"
        "from pipelines.detection import detect_points\n"
        "detect_points(test_finders.drawn(26.0, 20.0)[0], test_finders.TARGET)\n"
        "test_circle.found_in(*test_circle.board_with('tilted'))\n"
        "assert before == {f: list(f.signatures) for f in kernels}\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.full  # compiles
def test_compiling_is_told_only_where_nothing_was_kept(tmp_path, monkeypatch):
    """A thread's `must_compile` is true with an empty cache, false with a full one; left early, it ends early."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    code = (
        "from pipelines.detection import prepare\n"
        "prepare.MODULES = prepare.MODULES[-2:]\n"  # the quickest
        "with prepare.Kernels() as kernels:\n"
        "    print(kernels.must_compile())\n"
        "    kernels.finish()\n"
        "    print(kernels.must_compile())\n"
    )
    command = [sys.executable, "-c", code]
    cold, warm = (subprocess.run(command, capture_output=True, text=True, check=True).stdout for _ in range(2))
    assert cold.split() == ["True", "False"]
    assert warm.split() == ["False", "False"]

"""Machine code is kept for later runs, gives the same bits, and is never used after any source has changed."""

import os
import shutil
import subprocess
import sys
import time

import pytest

from eposit.compiled import cache
from eposit.compiled.cache import OLD_S, Cache, own_temporary_folder

SOLVE = """
import time, numpy as np, eposit
from eposit.compiled import machine_code
compiled = []
object_code = machine_code.object_code
machine_code.object_code = lambda kernel: compiled.append(kernel.name) or object_code(kernel)
camera = eposit.Camera(lens="equisolid", fx=500.0, fy=500.0, cx=800.0, cy=600.0, width=1600, height=1200)
points = np.array([(0.0, 0, 0), (200, 0, 0), (0, 200, 0), (0, 0, -50), (90, 110, 30)])
pixels = camera.project(points + (100, 100, 2000)) + np.sin(np.arange(10.0)).reshape(5, 2)
found = eposit.solve(points, pixels, camera)
print(found.cam_from_obj.R.tobytes().hex(), found.covariance.tobytes().hex(), len(compiled))
"""


@pytest.fixture
def places(tmp_path, monkeypatch):
    """A home and a folder for temporary files of our own."""
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    monkeypatch.setattr("tempfile.tempdir", None)
    return tmp_path


def solve_in_a_new_process():
    done = subprocess.run([sys.executable, "-c", SOLVE], capture_output=True, text=True, check=True)
    *bits, compiled = done.stdout.split()
    return bits, int(compiled)


def test_the_first_run_has_the_bits_of_later_ones_and_half_a_file_is_compiled_again(places):
    first, compiled = solve_in_a_new_process()
    assert compiled == 1
    (kept,) = (places / "home/.cache/eposit").iterdir()
    assert solve_in_a_new_process() == (first, 0)
    whole = kept.read_bytes()
    kept.write_bytes(whole[:-100])
    assert solve_in_a_new_process() == (first, 1)
    assert kept.read_bytes() == whole


@pytest.fixture
def package(tmp_path):
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "one.py").write_text("a = 1\n")
    return folder


def test_code_of_other_sources_or_another_processor_is_not_used(places, package):
    Cache({package}, ("x",)).write("f", b"code")
    assert Cache({package}, ("x",)).read("f") == b"code"
    assert Cache({package}, ("x",)).read("g") is None
    assert Cache({package}, ("y",)).read("f") is None
    (package / "two.py").write_text("a = 1\n")
    assert Cache({package}, ("x",)).read("f") is None


def test_a_home_that_cannot_be_written_has_a_folder_among_the_temporary_files(places, package):
    (places / "home").touch()  # a file where a folder should be stops root too
    Cache({package}, ()).write("f", b"code")
    assert Cache({package}, ()).read("f") == b"code"
    (own,) = (places / "tmp").iterdir()
    assert len(list(own.iterdir())) == 1
    shutil.rmtree(own)
    own.touch()
    Cache({package}, ()).write("f", b"code")  # nowhere, without a word
    assert Cache({package}, ()).read("f") is None


def test_files_that_are_a_month_old_go_when_a_new_one_comes(places, package):
    Cache({package}, ("x",)).write("f", b"code")
    (old,) = (places / "home/.cache/eposit").iterdir()
    os.utime(old, (time.time() - 2 * OLD_S,) * 2)
    Cache({package}, ("y",)).write("f", b"code")
    assert [path.name for path in old.parent.iterdir()] != [old.name]
    assert not old.exists()


def test_a_folder_of_somebody_else_is_not_used(places):
    folder = own_temporary_folder()
    assert folder is not None
    assert folder.stat().st_mode & 0o077 == 0
    folder.chmod(0o777)
    assert own_temporary_folder() is None
    assert folder not in cache.folders()

"""Compiled functions are kept for later runs, and never loaded after any source of the package has changed."""

import os
import shutil
import subprocess
import sys
import time

import pytest

from pipelines.detection import kernel_cache
from pipelines.detection.kernel_cache import PREFIX, choose_folder

PART = """
from pipelines.detection.kernels import inlined

@inlined
def part(x: float) -> float:
    return x + 1.0
"""
CALLER = """
from pipelines.detection.kernels import compiled
from pipelines.detection.part import part

@compiled
def whole(x: float) -> float:
    return part(x)
"""
CODE = "from pipelines.detection.caller import whole; print(whole(1.0), len(whole.stats.cache_hits))"


@pytest.fixture
def checkout(tmp_path):
    """A package that compiles one small function, which calls one in another file, by our decorators."""
    package = tmp_path / "checkout/pipelines/detection"
    package.mkdir(parents=True)
    for folder in (package, package.parent):
        (folder / "__init__.py").touch()
    for name in ("kernels.py", "kernel_cache.py"):
        shutil.copy(kernel_cache.PACKAGE / name, package)
    (package / "part.py").write_text(PART)
    (package / "caller.py").write_text(CALLER)
    return package


def run(package, **environment):
    """What the package's function gives for 1 in a new process, and how often machine code was loaded for it."""
    root = package.parents[1]
    own = {"HOME": str(root / "home"), "TMPDIR": str(root / "tmp")} | environment
    (root / "tmp").mkdir(exist_ok=True)
    rest = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA_", "XDG_"))}
    command = [sys.executable, "-c", CODE]
    done = subprocess.run(command, capture_output=True, text=True, env=rest | own, cwd=root)
    assert done.returncode == 0, done.stderr
    value, loaded = done.stdout.split()
    return float(value), int(loaded)


def kept_in(folder):
    """Folders for sources there, that hold machine code."""
    return {path for path in folder.glob(PREFIX + "*") if list(path.rglob("*.nbc"))}


@pytest.mark.full
def test_a_change_in_another_file_is_seen(checkout):
    """Numba alone looks at the caller's file only, and loads 2 again."""
    assert run(checkout) == (2.0, 0)
    assert run(checkout) == (2.0, 1)
    first = kept_in(checkout / "__pycache__")
    assert len(first) == 1
    (checkout / "part.py").write_text(PART.replace("1.0", "2.0"))
    assert run(checkout) == (3.0, 0)
    (checkout / "part.py").write_text(PART)
    assert run(checkout) == (2.0, 1)
    assert kept_in(checkout / "__pycache__") > first  # neither folder is a day old


def test_a_folder_that_the_user_has_set_is_kept_to(checkout, tmp_path):
    assert run(checkout, NUMBA_CACHE_DIR=str(tmp_path / "set")) == (2.0, 0)
    assert len(kept_in(tmp_path / "set")) == 1
    assert not kept_in(checkout / "__pycache__")


@pytest.mark.full
def test_a_read_only_checkout_has_the_users_folder_and_else_a_temporary_one(checkout):
    """A file where a folder should be stops root too. Numba alone raises `cannot cache function` without a home."""
    (checkout / "__pycache__").touch()
    root = checkout.parents[1]
    assert [run(checkout), run(checkout)] == [(2.0, 0), (2.0, 1)]
    assert len(kept_in(root / "home/.cache/numba")) == 1
    (root / "file").touch()
    nowhere = str(root / "file")
    assert [run(checkout, HOME=nowhere), run(checkout, HOME=nowhere)] == [(2.0, 0), (2.0, 1)]
    (own,) = (root / "tmp").glob("eposit-kernels-*")
    assert len(kept_in(own)) == 1


@pytest.mark.full
def test_where_nothing_can_be_written_functions_are_compiled_all_the_same(checkout):
    (checkout / "__pycache__").touch()
    root = checkout.parents[1]
    (root / "home").touch()
    (root / "tmp").mkdir()
    for name in ("own", str(os.getuid()) if hasattr(os, "getuid") else "own"):
        (root / f"tmp/eposit-kernels-{name}").touch()
    assert run(checkout) == (2.0, 0)


def test_options_and_files_that_shape_the_code_have_a_folder_each(checkout, monkeypatch):
    first = choose_folder(checkout)
    assert choose_folder(checkout) == first
    monkeypatch.setattr(kernel_cache.config, "BOUNDSCHECK", 1)
    second = choose_folder(checkout)
    (checkout / "more.py").touch()
    assert len({first, second, choose_folder(checkout)}) == 3


def test_folders_that_nothing_was_added_to_for_a_day_go_when_a_new_one_is_made(checkout, monkeypatch):
    monkeypatch.setattr(kernel_cache.config, "CACHE_DIR", "")
    place = checkout / "__pycache__"
    long_ago = time.time() - 2 * kernel_cache.OLD_S
    old, used, other = place / f"{PREFIX}old", place / f"{PREFIX}used", place / "other"
    for folder in (old, used, other):
        (folder / "detection").mkdir(parents=True)
        (folder / "detection/whole.nbc").touch()
        for path in (folder / "detection", folder):
            os.utime(path, (long_ago, long_ago))
    os.utime(old / "detection/whole.nbc", (long_ago, long_ago))
    new = choose_folder(checkout)
    assert set(place.iterdir()) == {used, other, new}


def test_what_other_packages_keep_stays_where_it_was(checkout):
    before = kernel_cache.config.CACHE_DIR
    with kernel_cache.numba_keeps_in(checkout):
        assert str(checkout) == kernel_cache.config.CACHE_DIR
    assert before == kernel_cache.config.CACHE_DIR

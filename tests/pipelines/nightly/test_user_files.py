"""Which files are copied of a user's function."""

import importlib
import sys

import pytest

from pipelines.nightly import user_files
from pipelines.nightly.user_files import files_of


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder from which modules are imported, and forgotten afterwards."""
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]


def _write(folder, **texts):
    for name, text in texts.items():
        path = folder / f"{name.replace('__', '/', 1)}.py" if not name.endswith("_init") else folder / name[:-5]
        if name.endswith("_init"):
            path = path / "__init__.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def _names(module, place):
    importlib.import_module(module)
    found = files_of(module)
    assert found.root == str(place.resolve())
    return {path.removeprefix(f"{found.root}/") for path in found.files}


def test_a_module_and_what_it_imports_from_its_folder(place):
    _write(place, ownsolve="import ownhelper, numpy", ownhelper="", ownother="")
    assert _names("ownsolve", place) == {"ownsolve.py", "ownhelper.py"}


def test_a_package_is_copied_whole(place):
    """With what it imports later, and what it reads."""
    _write(place, ownpackage_init="", ownpackage__solve="", ownpackage__later="")
    (place / "ownpackage" / "weights.bin").write_bytes(b"1")
    (place / "ownpackage" / ".hidden").write_bytes(b"1")
    assert _names("ownpackage.solve", place) == {
        f"ownpackage/{name}" for name in ("__init__.py", "solve.py", "later.py", "weights.bin")
    }


def test_a_folder_that_is_no_package(place):
    _write(place, ownfolder__solve="", ownfolder__other="")
    assert _names("ownfolder.solve", place) == {"ownfolder/solve.py"}


def test_of_libraries_only_the_package_itself():
    """What else lies beside an installed package is the environment's."""
    found = files_of(importlib.import_module("tomlkit.items").__name__)
    assert {path.removeprefix(found.root).split("/")[1] for path in found.files} == {"tomlkit"}


def test_what_is_too_large_is_not_copied(place, monkeypatch):
    monkeypatch.setattr(user_files, "MOST_BYTES", 10)
    _write(place, ownlarge="# more than ten bytes")
    importlib.import_module("ownlarge")
    found = files_of("ownlarge")
    assert found.files == ()
    assert "more than" in found.why_not


def test_a_module_without_a_file_is_not_copied():
    assert files_of("sys").why_not == "sys has no file"

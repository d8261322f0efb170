"""A compiler that rendering cannot use: one sentence, before it aborts the process."""

from __future__ import annotations

import sys

import pytest

from render import backend
from tests.wrong_input import alone, assert_one_sentence, assert_refused, garbage


def environment(variable, value):
    """Rendering in a process that looks for its compiler anew, with a variable set to a value or to a fake library."""

    def arrange(place):
        place.patch.setattr(backend, "load", backend.load.__wrapped__)
        place.patch.setenv("EPOSIT_VARIANT", backend.CPU_VARIANT)
        place.patch.setenv(variable, value(place) if callable(value) else value)
        return "generate", place.recipe(), "--out", place.new()

    return arrange


def fake_library(name):
    def write(place):
        path = place.folder / name
        path.write_bytes(garbage(b""))
        return str(path)

    return write


def old_llvm(place):
    """A real library that says it is LLVM 14."""
    place.patch.setattr(backend, "llvm_version", lambda library: 14)
    return fake_library("libLLVM.so")(place)


def other_library(place):
    """A library that can be loaded and is not LLVM."""
    place.patch.setattr(backend, "llvm_version", lambda library: None)
    return fake_library("libother.so")(place)


CASES = {
    "old LLVM": (environment(backend.LIBRARY_VARIABLE, old_llvm), "which is LLVM 14 and would abort the process"),
    "missing LLVM": (environment(backend.LIBRARY_VARIABLE, "nowhere/libLLVM.so"), "which is not a file"),
    "LLVM cannot be loaded": (
        environment(backend.LIBRARY_VARIABLE, fake_library("libLLVM-20.so")),
        "libLLVM-20.so', which cannot be loaded (",
    ),
    "no LLVM": (environment(backend.LIBRARY_VARIABLE, other_library), "which is not an LLVM library"),
    "unknown variant": (environment("EPOSIT_VARIANT", "scalar_rgb"), "EPOSIT_VARIANT is 'scalar_rgb'; it must be one"),
}


@pytest.mark.parametrize("name", CASES)
def test_an_unusable_compiler_gives_one_sentence(name, place, cli):
    assert_refused(CASES[name], place, cli)


def test_the_cpu_renders_where_there_is_a_gpu(monkeypatch):
    """A GPU beside it must not change a recipe's bits; Mitsuba refuses another variant than the one that runs here."""
    variant = backend.load().variant()
    monkeypatch.setattr(backend, "cuda_present", lambda: True)
    monkeypatch.delenv("EPOSIT_VARIANT", raising=False)
    if variant == backend.CPU_VARIANT:
        assert backend.load.__wrapped__().variant() == variant
    else:
        with pytest.raises(backend.BackendError, match="already runs"):
            backend.load.__wrapped__()


@pytest.mark.parametrize("workers", [pytest.param(1, marks=pytest.mark.full), 2])
def test_an_unusable_compiler_in_a_process_of_its_own(workers, place):
    library = {backend.LIBRARY_VARIABLE: fake_library("libLLVM.so")(place), "EPOSIT_VARIANT": backend.CPU_VARIANT}
    done = alone("generate", place.recipe(), "--out", place.new(), "--workers", workers, **library)
    assert_one_sentence(done.returncode, done.stderr, "which cannot be loaded")


def test_doctor_names_the_unusable_compiler(place, cli):
    environment(backend.LIBRARY_VARIABLE, old_llvm)(place)
    outcome = cli("doctor")
    assert_one_sentence(outcome.code, outcome.err, "see the lines marked MISSING")
    assert "MISSING  LLVM" in outcome.out


@pytest.fixture
def installed(place):
    """Puts fake libraries where those of Python packages lie, and lets the ones named sound be loaded."""

    def install(*names, sound):
        def version(library):
            if library.name not in sound:
                raise OSError("libc++.so.1: cannot open shared object file")
            return sound[library.name]

        place.patch.delenv(backend.LIBRARY_VARIABLE, raising=False)
        place.patch.setattr(sys, "prefix", str(place.folder))
        place.patch.setattr(backend, "SYSTEM_FOLDERS", ())
        place.patch.setattr(backend, "llvm_version", version)
        (place.folder / "lib").mkdir()
        for name in names:
            fake_library(f"lib/{name}")(place)

    return install


def test_the_newest_compiler_is_chosen(installed):
    installed("libLLVM-19.so", "libLLVM.so.21.1", "libLLVM-20.so", sound={"libLLVM-19.so": 19, "libLLVM.so.21.1": 21})
    assert backend.find_llvm().name == "libLLVM.so.21.1"


def test_a_compiler_that_cannot_be_loaded_is_passed_over(installed):
    installed("libLLVM-19.so", "libLLVM.so.21.1", "libLLVM-14.so", sound={"libLLVM-19.so": 19})
    assert backend.find_llvm().name == "libLLVM-19.so"


def test_without_a_usable_compiler_rendering_ends_in_one_sentence(installed, place, cli):
    installed("libLLVM.so.21.1", "libLLVM-14.so", sound={})
    place.patch.setattr(backend, "load", backend.load.__wrapped__)
    place.patch.setenv("EPOSIT_VARIANT", backend.CPU_VARIANT)
    place.patch.delitem(sys.modules, "drjit", raising=False)
    outcome = cli("generate", place.recipe(), "--out", place.new())
    words = (
        "found only libLLVM.so.21.1, which cannot be loaded (libc++.so.1: cannot open shared object file); libLLVM-14"
    )
    assert_one_sentence(outcome.code, outcome.err, words)

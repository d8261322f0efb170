"""A compiler that rendering cannot use: one sentence, before it aborts the process."""

from __future__ import annotations

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


CASES = {
    "old LLVM": (environment(backend.LIBRARY_VARIABLE, old_llvm), "names LLVM 14, which would abort the process"),
    "missing LLVM": (environment(backend.LIBRARY_VARIABLE, "nowhere/libLLVM.so"), "which is not a file"),
    "LLVM is no library": (
        environment(backend.LIBRARY_VARIABLE, fake_library("libLLVM-20.so")),
        "which is not an LLVM library",
    ),
    "unknown variant": (environment("EPOSIT_VARIANT", "scalar_rgb"), "EPOSIT_VARIANT is 'scalar_rgb'; it must be one"),
}


@pytest.mark.parametrize("name", CASES)
def test_an_unusable_compiler_gives_one_sentence(name, place, cli):
    assert_refused(CASES[name], place, cli)


@pytest.mark.parametrize("workers", [1, 2])
def test_an_unusable_compiler_in_a_process_of_its_own(workers, place):
    library = {backend.LIBRARY_VARIABLE: fake_library("libLLVM-14.so")(place), "EPOSIT_VARIANT": backend.CPU_VARIANT}
    done = alone("generate", place.recipe(), "--out", place.new(), "--workers", workers, **library)
    assert_one_sentence(done.returncode, done.stderr, "which is not an LLVM library")


def test_doctor_names_the_unusable_compiler(place, cli):
    environment(backend.LIBRARY_VARIABLE, old_llvm)(place)
    outcome = cli("doctor")
    assert_one_sentence(outcome.code, outcome.err, "see the lines marked MISSING")
    assert "MISSING  LLVM" in outcome.out

"""Machine code gives the bits of plain Python, and what cannot be translated is refused with its place."""

import math

import numpy as np
import pytest

from eposit.compiled.kernel import NUMBER, WHOLE, Kernel, W, compiled, four
from eposit.compiled.machine_code import native
from eposit.compiled.translate import module_text
from tests.eposit.compiled import kernels_under_test as kernels

N = 6


def plain(kernel, w, *arguments):
    """What Python makes of a kernel, with the kernels that it calls as plain functions too."""
    names = kernel.function.__globals__
    with pytest.MonkeyPatch.context() as patch:
        for name, value in list(names.items()):
            if isinstance(value, Kernel):
                patch.setitem(names, name, value.function)
        return kernel.function(w, *arguments)


@pytest.mark.parametrize(
    ("kernel", "more"),
    [
        (kernels.arithmetic, ()), (kernels.functions, ()), (kernels.loops, ()), (kernels.tests, (1,)),
        (kernels.tests, (0,)), (kernels.exchange, ()), (kernels.calls, ()), (kernels.lanes, ()),
    ],
    ids=lambda value: getattr(value, "name", str(value)).rpartition(".")[2],
)  # fmt: skip
def test_machine_code_gives_the_bits_of_plain_python(kernel, more):
    rng = np.random.default_rng(1)
    for _ in range(50):
        w = rng.uniform(-3.0, 3.0, N + 2)
        w[rng.integers(N)] = 0.25
        expected = w.copy()
        result = plain(kernel, expected, N, *more)
        assert native(kernel)(w.ctypes.data, N, *more) == result
        np.testing.assert_array_equal(w, expected)


def test_a_division_by_zero_is_infinite_and_nothing_is_read_that_was_not_asked_for():
    w = np.array([0.0, 2.0] + [0.5] * N)
    native(kernels.arithmetic)(w.ctypes.data, N)
    assert math.isinf(native(kernels.arithmetic)(w.ctypes.data, 1)) or math.isnan(
        native(kernels.arithmetic)(w.ctypes.data, 1)
    )
    short = np.array([1.0, 2.0])  # with n = 2 the third number is none of ours
    assert native(kernels.tests)(short.ctypes.data, 2, 1) == 1


def test_each_of_four_numbers_is_treated_on_its_own():
    rng = np.random.default_rng(2)
    for _ in range(50):
        w, out = rng.uniform(-3.0, 3.0, N), np.empty((3, 4))
        native(kernels.apart)(w.ctypes.data, out.ctypes.data)
        once = [kernels.bent.function(x) for x in w[:4]]
        np.testing.assert_array_equal(out[:2], [once, once])
        several = [kernels.two.function(x, w[4]) for x in w[:4]]
        np.testing.assert_array_equal(out[2], [x + 10.0 * which for x, which in several])


@compiled(NUMBER, W)
def changes_type(w):
    """A whole number that becomes a number."""
    count = 0
    if w[0] > 0.0:
        count = w[0]
    return count


@compiled(NUMBER, W)
def has_a_list(w):
    """A list."""
    return [w[0]][0]


@compiled(NUMBER, W)
def calls_numpy(w):
    """A function of NumPy."""
    return np.sum(w)


@compiled(WHOLE, W)
def returns_a_fraction(w):
    """A number from a function of whole numbers."""
    return w[0]


@compiled(NUMBER, W)
def asks_four_at_once(w):
    """A test of four numbers that is to decide between two blocks."""
    if four(w[0], w[1], w[2], w[3]) > 0.0:
        return 1.0
    return 0.0


@pytest.mark.parametrize("kernel", [changes_type, has_a_list, calls_numpy, returns_a_fraction, asks_four_at_once])
def test_what_cannot_be_translated_is_refused_with_its_place(kernel):
    with pytest.raises(TypeError, match=r"test_translate\.py:\d+: "):
        module_text(kernel)

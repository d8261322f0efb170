"""Numbers: the digits that an interval supports, no more."""

import numpy as np
import pytest

from pipelines.pages.numbers import NONE, leading_number, share, two_digits, with_interval
from pipelines.statistics import Interval

NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("found", "signed", "told"),
    [
        ((0.0038912, 0.0029, 0.0047), False, "0.0039 [0.0029, 0.0047]"),
        ((0.000831, 0.00073, 0.00126), False, "0.00083 [0.00073, 0.00126]"),
        ((99.2, 97.1, 103.0), False, "99 [97, 103]"),
        ((0.00021, -0.00012, 0.00053), True, "+0.0002 [-0.0001, +0.0005]"),
        ((4.6e-13, 7.4e-14, 4.7e-13), False, "4.6e-13 [7.4e-14, 4.7e-13]"),
        ((3.14159, -INF, INF), False, "3.1"),  # a single value has no interval
        ((NAN, NAN, NAN), False, NONE),
    ],
)
def test_values_with_intervals(found, signed, told):
    assert with_interval(Interval(*found), signed) == told


def test_no_interval_is_a_dash():
    assert with_interval(None) == NONE


def test_a_column_of_two_digits_keeps_its_zeros():
    values = [0.01, 0.1, 1.0, 10.0, 123.4, 0.0087]
    assert [two_digits(value) for value in values] == ["0.010", "0.10", "1.0", "10", "123", "0.0087"]
    assert two_digits(np.nan) == NONE


def test_shares_are_per_cent():
    assert share(Interval(0.975, 0.93, 1.0)) == "97.5 [93, 100] %"


@pytest.mark.parametrize(
    ("text", "number"), [("1.5 [1, 2]", 1.5), ("-3e-5 px", -3e-5), ("26 of 40", 26.0), ("about 0", None), ("", None)]
)
def test_a_column_is_sorted_by_the_number_that_its_cells_begin_with(text, number):
    assert leading_number(text) == number

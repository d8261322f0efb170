"""Work in threads behind the rendering: order, errors, a bound on what is in flight."""

import functools
import threading
import time

import pytest

from datasets.errors import UserError
from pipelines.engines.background import IN_FLIGHT, overlapped


def late(number):
    time.sleep(0.02 if number % 3 == 0 else 0.0)  # later ones end first
    return number


def fails(number):
    if number == 3:
        raise UserError("three is wrong")
    return number


def test_rows_come_in_order_and_each_is_told():
    told = []
    rows = overlapped((functools.partial(late, i) for i in range(20)), lambda: told.append(1))
    assert list(rows) == list(range(20))
    assert len(told) == 20


def test_an_error_of_a_maker_or_of_the_source_surfaces():
    with pytest.raises(UserError, match="three is wrong"):
        list(overlapped(functools.partial(fails, i) for i in range(20)))
    with pytest.raises(UserError, match="three is wrong"):
        list(overlapped(functools.partial(late, fails(i)) for i in range(20)))


def test_few_are_in_flight():
    lock, begun, ended, most = threading.Lock(), [], [], []

    def source():
        for i in range(30):
            with lock:
                begun.append(i)
                most.append(len(begun) - len(ended))
            yield functools.partial(slow, i)

    def slow(i):
        time.sleep(0.002)
        with lock:
            ended.append(i)
        return i

    assert list(overlapped(source())) == list(range(30))
    assert max(most) <= IN_FLIGHT

"""Engines: every task once, errors reach the caller, a killed worker is a sentence."""

import os
import signal

import pytest

from datasets.errors import UserError
from pipelines.engines.local import LocalEngine


def double(task):
    return 2 * task


def fails_at_two(task):
    if task == 2:
        raise UserError("two is wrong")


def dies_at_two(task):
    if task == 2:
        os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.parametrize("workers", [1, 2])
def test_every_task_is_done_once(workers):
    assert sorted(LocalEngine(workers).map(double, range(5))) == [(0, 0), (1, 2), (2, 4), (3, 6), (4, 8)]


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_in_a_task_reaches_the_caller(workers):
    with pytest.raises(UserError, match="two is wrong"):
        list(LocalEngine(workers).map(fails_at_two, range(5)))


def test_a_killed_worker_is_a_sentence():
    with pytest.raises(UserError, match="killed"):
        list(LocalEngine(2).map(dies_at_two, range(5)))


@pytest.mark.parametrize("workers", [0, -1, 100000])
def test_workers_out_of_range(workers):
    with pytest.raises(UserError, match="--workers from 1"):
        LocalEngine(workers)

"""A process that serves another one ends without a word when that one has gone."""

import pytest

from pipelines.adapters import process
from pipelines.adapters.limits import DEFAULT
from pipelines.adapters.process import Form
from pipelines.children import start
from pipelines.engines import worker
from tests.own import own_module

PATIENCE_S = 60.0  # for a process to start, import and end on a crowded machine


def double(task):
    return 2 * task


@pytest.mark.parametrize("is_read", [True, False])  # a pipe that closes with something unread in it is reset
@pytest.mark.parametrize("served", ["worker", "function"])
def test_a_process_whose_caller_has_gone_ends_in_silence(served, is_read, tmp_path, monkeypatch, capfd):
    if served == "worker":
        child = start(worker.serve, double)
        child.pipe.send(2)
    else:
        module = own_module(tmp_path, monkeypatch, "def solve(points_in_obj, points_px, camera): pass")
        child = start(process._serve, f"{module}:solve", Form("--solver", "(points_in_obj, ...)", 3), DEFAULT)
    assert child.pipe.poll(PATIENCE_S)
    if is_read:
        child.pipe.recv()
    child.pipe.close()
    child.process.join(PATIENCE_S)
    assert child.process.exitcode == 0
    assert capfd.readouterr().err == ""

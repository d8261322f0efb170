"""What a run shows of compiling: a bar where it waits for it and nothing else, the compiler's error, an early end."""

import io
import threading

import pytest
from numba.core import event
from rich.console import Console

from datasets.store.dataset import open_dataset
from pipelines.detection import prepare
from pipelines.stages.kernels import WAITING, compiled_ahead, wait_for
from pipelines.stages.part import WHOLE


class Module:
    """Stands for a module of compiled functions: `prepare` tells that it compiles, waits for a sign, and may fail."""

    def __init__(self, compiles=False, error=None, sign=None):
        self.compiles, self.error, self.sign = compiles, error, sign
        self.begun, self.done = False, False

    def prepare(self):
        self.begun = True
        if self.compiles:
            event.broadcast(event.Event("numba:compile", event.EventStatus.START))
            event.broadcast(event.Event("numba:compile", event.EventStatus.END))
        if self.sign is not None:
            assert self.sign.wait(60.0)
        if self.error is not None:
            raise self.error
        self.done = True


class WaitedFor(prepare.Kernels):
    """Its modules go on when they are waited for: by then the bar has been shown or not."""

    def finish(self):
        for module in prepare.MODULES:
            if module.sign is not None:
                module.sign.set()
        super().finish()


@pytest.fixture
def shown(monkeypatch):
    """Waits for functions of a module, and returns what is shown on a terminal meanwhile."""

    def wait(module, quiet=False):
        monkeypatch.setattr(prepare, "MODULES", (module,))
        console = Console(file=io.StringIO(), force_terminal=True, width=120, quiet=quiet)
        with WaitedFor() as kernels:
            wait_for(kernels, console)
        assert module.done
        return console.file.getvalue()

    return wait


def test_a_bar_says_what_is_waited_for_where_something_is_compiled(shown):
    assert WAITING in shown(Module(compiles=True, sign=threading.Event()))


def test_what_was_kept_shows_nothing(shown):
    assert shown(Module()) == ""


def test_a_quiet_run_shows_nothing(shown):
    assert shown(Module(compiles=True, sign=threading.Event()), quiet=True) == ""


def test_without_anything_begun_there_is_nothing_to_wait_for():
    wait_for(None, Console(file=io.StringIO()))


@pytest.mark.parametrize("compiles", [True, False])
def test_an_error_of_the_compiler_is_told(shown, compiles):
    with pytest.raises(RuntimeError, match="cannot compile"):
        shown(Module(compiles, RuntimeError("cannot compile")))


def test_an_early_end_leaves_out_what_has_not_begun(monkeypatch):
    """The body fails while the first module is compiled: the second never begins, and no thread is left."""
    kernels = prepare.Kernels()
    first, second = Module(compiles=True, sign=kernels._stop), Module(compiles=True)  # the first ends after the body
    monkeypatch.setattr(prepare, "MODULES", (first, second))
    threads = set(threading.enumerate())

    def interrupted():
        with kernels:
            assert kernels.must_compile()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert first.done
    assert not second.begun
    assert set(threading.enumerate()) <= threads


def test_nothing_is_begun_where_no_shard_is_missing(tiny, monkeypatch):
    """The tiny dataset has all its detections."""
    module = Module()
    monkeypatch.setattr(prepare, "MODULES", (module,))
    with compiled_ahead(open_dataset(tiny[1]), WHOLE) as kernels:
        assert kernels is None
    assert not module.begun
    with compiled_ahead(open_dataset(tiny[1]), WHOLE, "opencv-sb") as kernels:
        kernels.finish()
    assert module.done


def test_what_has_begun_is_gone_on_with(tiny, monkeypatch):
    monkeypatch.setattr(prepare, "MODULES", ())
    with (
        prepare.Kernels() as begun,
        compiled_ahead(open_dataset(tiny[1]), WHOLE, "opencv-sb", begun) as kernels,
    ):
        assert kernels is begun

"""A user's function in a process of its own: exit, hang, fork, crash, print or greed is a status of one image."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from datasets.errors import UserError
from eposit import Status
from pipelines.adapters.limits import Limits, lift_memory_limit, limit_memory
from pipelines.adapters.results import PoseResult
from pipelines.adapters.user import attempt, check_call, load_function
from pipelines.children import OTHER_END_GONE, Child, start

START_S = 120.0  # for starting the process and importing the function, at least: a crowded machine takes its time


@dataclass(frozen=True, slots=True)
class Form:
    """How a function is called."""

    option: str  # --solver or --estimator
    text: str  # its arguments as a message shows them
    count: int  # of its arguments
    keyword: str = ""  # one that it may take


class FunctionProcess:
    """Calls a function for one image after the other. A process that ended, or took too long, is replaced."""

    def __init__(self, name: str, form: Form, limits: Limits) -> None:
        self._child: Child | None = None
        self._name, self._form, self._limits = name, form, limits
        self.takes_keyword: bool = self._started()

    def call(self, tell: Callable[[str], None], *arguments: Any, **keywords: Any) -> PoseResult:
        """The answer for one image; what went wrong is a status and a line for `tell`.

        Raises:
            UserError: a result that cannot be understood, as it would be for every image.
        """
        if self._child is None:
            self._started()
        answer = self._answer(self._limits.seconds, (arguments, keywords))
        if isinstance(answer, str):
            tell(answer)
            return PoseResult(Status.SOLVER_ERROR)
        result, notes = answer
        for note in notes:
            tell(note)
        return result

    def end(self) -> None:
        """End the process, and those that the function has started."""
        if self._child is not None:
            self._child.kill(group=True)
            self._child = None

    def __del__(self) -> None:
        self.end()

    def _started(self) -> bool:
        """Start the process; whether the function takes the keyword.

        Raises:
            UserError: it cannot be imported or called, or importing it ends the process or takes too long.
        """
        self._child = start(_serve, self._name, self._form, self._limits)
        answer = self._answer(max(START_S, self._limits.seconds))
        if isinstance(answer, str):
            raise UserError(f"{self._form.option} {self._name}: importing it failed: it {answer}; mend it")
        return answer

    def _answer(self, limit_s: float, question: Any = None) -> Any:
        """What the process sends, after it was sent a question; a text of why it could not, and of what became of it.

        Raises:
            UserError: the process sent one.
        """
        child = self._child
        assert child is not None
        try:
            if question is not None:
                child.pipe.send(question)
            if not wait([child.pipe, child.process.sentinel], limit_s):
                self.end()
                return f"took longer than {limit_s:g} s"
            if child.pipe.poll():
                answer = child.pipe.recv()
                if isinstance(answer, UserError):
                    raise answer
                if isinstance(answer, str):
                    self.end()  # with what it holds
                return answer
        except (EOFError, OSError):
            pass
        told = f"ended its process, which {child.end}"
        self.end()
        return told


@functools.lru_cache(maxsize=1)
def function_process(name: str, form: Form, limits: Limits) -> FunctionProcess:
    """A process that calls package.module:function; the one of the last call if it is for the same.

    `end_function_process` ends it, and so does the end of this process.

    Raises:
        UserError: the function cannot be imported or called.
    """
    return FunctionProcess(name, form, limits)


def end_function_process() -> None:
    """End the process of `function_process`, so that the next one imports the function anew."""
    function_process.cache_clear()


def _serve(pipe: Connection, name: str, form: Form, limits: Limits) -> None:
    """Call the function for what comes through the pipe; what it prints goes to stderr.

    A function may break what this needs, as the pipe's descriptor or an import: the process then ends with a line.
    """
    try:
        limit_memory(limits)
        _answer_calls(pipe, name, form)
    except (MemoryError, OutOfMemoryError):
        lift_memory_limit()
        pipe.send(f"ran out of memory, of which --memory-mb allows {limits.memory_mb} MB")
    except OTHER_END_GONE:  # with the worker that asked: nobody is left to be told
        return
    except Exception as error:
        sys.exit(f"{form.option} {name} broke its own process ({type(error).__name__}: {error})")


def _answer_calls(pipe: Connection, name: str, form: Form) -> None:
    own = os.getpid()
    if hasattr(os, "setpgid"):
        os.setpgid(0, 0)
    os.dup2(2, 1)
    what = f"{form.option} {name}"
    try:
        function = _tamed(load_function, name, form.option)
        pipe.send(check_call(function, what, form.text, form.count, form.keyword))
        while True:
            arguments, keywords = pipe.recv()
            notes: list[str] = []
            answer = attempt(functools.partial(_tamed, function, *arguments, **keywords), what, notes.append)
            if os.getpid() != own:  # the function has forked, and came back twice
                os._exit(0)
            pipe.send((answer, notes))
    except UserError as error:
        pipe.send(error)
    except RaisedToEndError as error:
        pipe.send(UserError(f"{what}: importing it failed with {error}; mend it"))


class OutOfMemoryError(BaseException):
    """What a user's function raised for lack of memory; no Exception, so that it ends the process with all it holds."""


class RaisedToEndError(Exception):
    """What a user's function raised to end its process, as KeyboardInterrupt; the message is its name and text."""


def _tamed(function: Callable[..., Any], *arguments: Any, **keywords: Any) -> Any:
    """What a function gives; what it raises to end its process is a failure of one image as any other.

    Raises:
        OutOfMemoryError: it raised a MemoryError.
        Exception: what it raised.
    """
    try:
        return function(*arguments, **keywords)
    except MemoryError:
        raise OutOfMemoryError from None
    except (Exception, SystemExit):
        raise
    except BaseException as error:
        raise RaisedToEndError(f"{type(error).__name__}: {error}"[:300].rstrip(": ")) from None

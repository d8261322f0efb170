"""The engine of a Ray cluster: each task may run on any node, and runs again if its node is lost.

This is the only file that imports Ray, and it does so when the engine is first used. Every node needs the same Python
environment and checkout, and sees the dataset's folder under the same path, or reaches it by its URL.
"""

from __future__ import annotations

import functools
import os
import socket
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from datasets.errors import UserError
from pipelines.engines.engine import FATAL, Failure, Result, Task, check_workers

RETRIES = 5  # of a task whose process or node was lost
CONNECT_S = 10.0
STORE_BYTES = 100 * 2**20  # Ray's shared memory on this machine: results are a line of text at most


@dataclass(frozen=True, slots=True)
class RayEngine:
    """Tasks run on a Ray cluster, each on one processor.

    A Ray that this engine has started ends with the process. On a cluster that runs already the cluster's processors
    decide how many tasks run at once.

    Raises:
        UserError: a number of workers that is not usable, or one beside an address.
    """

    workers: int = 1
    address: str | None = None  # host:port of a cluster's head; None: a Ray of `workers` processors on this machine

    def __post_init__(self) -> None:
        check_workers(self.workers)
        if self.address is not None and self.workers != 1:
            raise UserError("--workers does not go with --ray-address, as the cluster decides; leave one of them out")

    def runs_here(self, tasks: Sequence[object]) -> bool:
        """Whether `map` would run these tasks in this process: never."""
        return False

    def map(
        self,
        run_one: Callable[[Task], Result],
        tasks: Sequence[Task],
        failed: Callable[[Task, Failure], None] | None = None,
    ) -> Iterator[tuple[Task, Result]]:
        """Run every task, and yield each with its result when it is done, in any order.

        Relative paths mean the same on every node: tasks run in the folder of this process.

        Raises:
            UserError: no cluster answers, or a task was lost more than `RETRIES` times.
            Exception: what a task raised; tasks not yet begun are cancelled.
        """
        ray = _connected(self)
        # A task that raises is not tried again: it would raise again. One whose node is lost is.
        remote = ray.remote(num_cpus=1, max_retries=RETRIES, retry_exceptions=False)(_run_in)
        run_there = functools.partial(remote.remote, str(Path.cwd()), run_one)
        references = {run_there(task): task for task in tasks}
        waiting = list(references)
        try:
            while waiting:
                (done,), waiting = ray.wait(waiting, num_returns=1)
                try:
                    result = _result(ray, done)
                except FATAL:
                    raise
                except Exception as error:
                    if failed is None:
                        raise
                    failed(references[done], Failure(error))
                    continue
                yield references[done], result
        finally:
            for reference in waiting:
                ray.cancel(reference)


def check_address(address: str) -> None:
    """Refuse an address where nobody answers, at once: Ray itself would try for minutes.

    Raises:
        UserError: another form than host:port, or no answer.
    """
    host, _, port = address.rpartition(":")
    if not (host and port.isdecimal() and port.isascii()) or "/" in host:
        raise UserError(f"address {address!r} is not usable; give --ray-address HOST:PORT of the cluster's head")
    try:
        socket.create_connection((host.strip("[]"), int(port)), CONNECT_S).close()
    except (OSError, OverflowError, UnicodeError) as error:
        raise UserError(
            f"nobody answers at {address} ({error}); start Ray there with `ray start --head`, or correct --ray-address"
        ) from None


def _run_in(folder: str, run_one: Callable[[Task], Result], task: Task) -> Result:
    os.chdir(folder)
    with threadpool_limits(1, "blas"):  # as `pipelines.__main__` has it
        return run_one(task)


def _connected(engine: RayEngine) -> Any:
    """The module `ray`, connected to the engine's cluster; one connection serves every stage of a run.

    Raises:
        UserError: no cluster answers.
    """
    import ray

    library: Any = ray  # a type checker takes the name for this file
    if library.is_initialized():
        return library
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": "ERROR"}
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # nothing is sent to Ray's makers unless the user says so
    try:
        if engine.address is None:
            local = {"num_cpus": engine.workers, "object_store_memory": STORE_BYTES, "include_dashboard": False}
            library.init(address="local", **local, **quiet)
        else:
            library.init(address=engine.address, **quiet)
    except (ConnectionError, RuntimeError, ValueError) as error:
        where = "Ray does not start on this machine" if engine.address is None else f"no Ray at {engine.address}"
        reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise UserError(f"{where} ({reason}); start it with `ray start --head`, or correct --ray-address") from error
    return library


def _result(ray: Any, reference: Any) -> Any:
    """What a task returned.

    Raises:
        UserError: it was lost too often.
        Exception: what it raised.
    """
    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        raise error.cause from None
    except ray.exceptions.RayError as error:
        raise UserError(
            f"a shard was lost {RETRIES + 1} times with its process or node ({type(error).__name__}), often for lack "
            "of memory; run the same command again to go on"
        ) from None

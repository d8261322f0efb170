"""The engines by name, as `--engine` has them."""

from __future__ import annotations

import importlib.util

from datasets.errors import UserError
from pipelines.engines.engine import Engine
from pipelines.engines.local import LocalEngine

ENGINES = ("local", "ray")


def engine_of(name: str, workers: int, ray_address: str | None = None) -> Engine:
    """The engine of a name.

    ray_address: of a Ray cluster that runs already; None starts a Ray of `workers` processes on this machine.

    Raises:
        UserError: an unknown name, options that do not go together, or Ray that is not installed.
    """
    if name not in ENGINES:
        raise UserError(f"unknown engine {name!r}; choose one of {', '.join(ENGINES)}")
    if name == "local":
        if ray_address is not None:
            raise UserError("--ray-address goes with --engine ray; add it, or leave out the address")
        return LocalEngine(workers)
    if importlib.util.find_spec("ray") is None:
        raise UserError(
            '--engine ray needs Ray, which is not installed; run `python -m pip install "ray>=2.9"` with the Python '
            "that runs this, or leave out --engine ray"
        )
    from pipelines.engines.ray import RayEngine

    return RayEngine(workers, ray_address)

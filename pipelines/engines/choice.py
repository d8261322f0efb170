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
        UserError: an unknown name, options that do not go together, Ray that is not installed, or no
            answer at the address.
    """
    if name not in ENGINES:
        raise UserError(f"unknown engine {name!r}; choose one of {', '.join(ENGINES)}")
    if name == "local":
        if ray_address is not None:
            raise UserError("--ray-address goes with --engine ray; add it, or leave out the address")
        return LocalEngine(workers)
    package = importlib.util.find_spec("ray")
    if package is None or package.origin is None:  # without an origin it is a folder `ray` where this runs
        raise UserError(
            '--engine ray needs Ray, which is not installed; run `python -m pip install "ray>=2.9"` with the Python '
            "that runs this, or leave out --engine ray"
        )
    from pipelines.engines.ray import RayEngine, check_address

    engine = RayEngine(workers, ray_address)
    if ray_address is not None:
        check_address(ray_address)
    return engine

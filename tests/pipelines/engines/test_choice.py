"""Engines by name: the right one, and a sentence for every wrong choice."""

import importlib.util
import socket
from types import SimpleNamespace

import pytest

from datasets.errors import UserError
from pipelines.engines.choice import engine_of
from pipelines.engines.local import LocalEngine
from pipelines.engines.ray import RayEngine


@pytest.fixture
def with_ray(monkeypatch):
    """As if Ray were installed."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: SimpleNamespace(origin="ray"))


@pytest.fixture
def port():
    """A port of this machine where somebody answers."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server.getsockname()[1]


def test_local_is_this_machine():
    assert engine_of("local", 3) == LocalEngine(3)


def test_ray_is_a_cluster_or_starts_one(with_ray, port):
    assert engine_of("ray", 3) == RayEngine(3, None)
    assert engine_of("ray", 1, f"127.0.0.1:{port}") == RayEngine(1, f"127.0.0.1:{port}")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("spark", 1), "unknown engine 'spark'; choose one of local, ray"),
        (("local", 1, "head:6379"), "--ray-address goes with --engine ray"),
        (("local", 0), "0 workers are not usable"),
        (("ray", 0), "0 workers are not usable"),
        (("ray", 2, "head:6379"), "--workers does not go with --ray-address"),
        (("ray", 1, "head"), "address 'head' is not usable; give --ray-address HOST:PORT"),
        (("ray", 1, "ray://head:10001"), "is not usable"),
        (("ray", 1, "127.0.0.1:1"), "nobody answers at 127.0.0.1:1"),
        (("ray", 1, "127.0.0.1:99999"), "nobody answers at 127.0.0.1:99999"),
    ],
)
def test_a_wrong_choice_is_a_sentence(words, message, with_ray):
    with pytest.raises(UserError, match=message):
        engine_of(*words)


@pytest.mark.parametrize("found", [None, SimpleNamespace(origin=None)], ids=["nothing", "a folder named ray"])
def test_without_ray_it_says_what_to_install(found, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: found)
    with pytest.raises(UserError, match=r'is not installed; run `python -m pip install "ray>=2.9"`'):
        engine_of("ray", 1)

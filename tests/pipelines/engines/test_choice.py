"""Engines by name: the right one, and a sentence for every wrong choice."""

import importlib.util

import pytest

from datasets.errors import UserError
from pipelines.engines.choice import engine_of
from pipelines.engines.local import LocalEngine
from pipelines.engines.ray import RayEngine


def test_local_is_this_machine():
    assert engine_of("local", 3) == LocalEngine(3)


def test_ray_is_a_cluster_or_starts_one(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: True)
    assert engine_of("ray", 3) == RayEngine(3, None)
    assert engine_of("ray", 1, "head:6379") == RayEngine(1, "head:6379")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("spark", 1), "unknown engine 'spark'; choose one of local, ray"),
        (("local", 1, "head:6379"), "--ray-address goes with --engine ray"),
        (("local", 0), "0 workers are not usable"),
        (("ray", 0), "0 workers are not usable"),
        (("ray", 2, "head:6379"), "--workers does not go with --ray-address"),
    ],
)
def test_a_wrong_choice_is_a_sentence(words, message, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: True)
    with pytest.raises(UserError, match=message):
        engine_of(*words)


def test_without_ray_it_says_what_to_install(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(UserError, match=r'is not installed; run `python -m pip install "ray>=2.9"`'):
        engine_of("ray", 1)

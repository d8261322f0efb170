"""`compare`: exit code, table and JSON of two datasets against each other."""

import json
import shutil

import numpy as np
import pytest

from pipelines.nightly import measures
from tests.pipelines.nightly import simulated


@pytest.fixture
def nights(monkeypatch, tmp_path, tiny):
    """Two folders that hold a dataset each, whose measures are simulated; a fault is planted in the second."""

    def make(fault=None, paired=True, poses=20):
        folders = [tmp_path / "old", tmp_path / "new"]
        for folder in folders:
            shutil.copytree(tiny[1], folder)
        rng = np.random.default_rng(0)
        drawn = {
            folder: simulated.night(poses, rng, plant) for folder, plant in zip(folders, (None, fault), strict=True)
        }
        monkeypatch.setattr(measures, "measure", lambda dataset: drawn[dataset.root])
        monkeypatch.setattr(measures, "same_views", lambda *_: paired)
        return folders

    return make


def test_a_dataset_is_identical_to_itself(tiny, cli):
    outcome = cli("compare", tiny[1], tiny[1])
    assert (outcome.code, outcome.out) == (0, "identical: every number of every frame is the same\n")


def test_a_fault_is_exit_code_1_and_stands_in_the_table(nights, cli):
    outcome = cli("compare", *nights(simulated.corner_bias(0.002)))
    assert outcome.code == 1
    where, _, row = outcome.out.splitlines()[:3]
    assert where == "typical/equisolid/edge-fit"
    assert row.split()[:3] == ["worse", "corner_x", "(px)"]
    assert "frame by frame" in outcome.out
    assert max(map(len, outcome.out.splitlines()[:-1])) <= 80  # the last is a sentence


def test_no_fault_is_exit_code_0(nights, cli):
    outcome = cli("compare", *nights())
    assert outcome.code == 0
    assert "worse" not in outcome.out


def test_json_has_every_metric(nights, cli):
    outcome = cli("compare", *nights(simulated.corner_bias(0.002), paired=False), "--json")
    told = json.loads(outcome.out)
    assert outcome.code == 1
    assert told["worse"]
    assert not told["paired"]
    assert len(told["findings"]) == 80
    (worse,) = [item for item in told["findings"] if item["verdict"] == "worse"]
    assert worse["slice"] == "typical/equisolid/edge-fit"
    assert worse["smallest_visible"] >= worse["margin"] == 0.0005


@pytest.mark.parametrize("alpha", ["0", "1", "-2", "nan"])
def test_a_chance_lies_between_0_and_1(tiny, cli, alpha):
    outcome = cli("compare", tiny[1], tiny[1], "--alpha", alpha)
    assert outcome.code == 2
    assert outcome.err.startswith("error: --alpha")
    assert outcome.err.count("\n") == 1


def test_too_few_poses_is_a_sentence(nights, cli):
    outcome = cli("compare", *nights(poses=3))
    assert outcome.code == 2
    assert "have no slice with 5 common poses" in outcome.err


def test_a_folder_without_scores_is_a_sentence(tiny, tmp_path, cli):
    folder = tmp_path / "no-scores"
    shutil.copytree(tiny[1], folder)
    shutil.rmtree(folder / "scores")
    outcome = cli("compare", tiny[1], folder)
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1

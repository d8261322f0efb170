"""Other libraries read the tables as we do: rows, pixels, poses; failures leave their averages alone."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml

from datasets.rows import decode_image, numbers
from datasets.schema import meanings
from datasets.store.dataset import open_dataset
from datasets.store.images import encode_png
from tests import other_readers
from tests.tables import OF_A_RUN
from tests.wrong_input import put_image

PACKAGES = ("datasets", "duckdb", "pandas", "pillow", "polars", "pyarrow")
TORCH = "EPOSIT_TORCH"  # what pip is to install for torch, if anything: its wheels are large


@pytest.fixture
def with_failure(place, cli):
    """A dataset in which one of two frames shows no board."""
    root = place.dataset(without=["detections", "estimates", "scores"])
    put_image(root, encode_png(np.full((300, 400), 90, np.uint8)))
    for name in ("detect", "estimate", "score"):
        assert cli(name, root, "-q").code == 0
    return root


def front_matter(root):
    return yaml.safe_load((root / "README.md").read_text().split("---\n")[1])["configs"]


def test_the_card_names_the_files_of_each_table(with_failure, cli, place):
    configs = front_matter(with_failure)
    assert [config["config_name"] for config in configs] == list(OF_A_RUN)
    assert [config["config_name"] for config in configs if config.get("default")] == ["frames"]
    for config in configs:
        assert set(with_failure.glob(config["data_files"])) == set((with_failure / config["config_name"]).iterdir())
    assert cli("generate", place.recipe(), "--out", place.new(), "--reuse", with_failure, "-q").code == 0
    assert [config["config_name"] for config in front_matter(place.new())] == ["frames", "keypoints"]


@pytest.mark.parametrize("table", OF_A_RUN)
def test_every_shard_tells_what_it_holds(table, tiny):
    for path in (tiny[1] / table).iterdir():
        footer = pq.read_schema(path).metadata
        assert json.loads(footer[b"meanings"]) == meanings(OF_A_RUN[table])
        assert all(json.loads(footer[b"meanings"]).values())
        features = json.loads(footer.get(b"huggingface", '{"info": {"features": {}}}'))["info"]["features"]
        assert features == ({"image": {"_type": "Image"}} if table == "frames" else {})


def test_a_footer_is_small(tiny):
    """A score's has 5.5 kB, and had 9.6 kB with Arrow's copy of the schema; 5.8 kB leaves room for a column or two."""
    for path in (tiny[1] / "scores").iterdir():
        assert pq.read_metadata(path).serialized_size < 5800


def expected_of(root, path):
    """What this project reads, for `other_readers`."""
    dataset = open_dataset(root)
    frames, scores = dataset.read("frames"), dataset.read("scores")
    pixels = [decode_image(row["image"], root, row["frame_id"]) for row in frames.to_pylist()]
    errors = numbers(scores, other_readers.ERROR)[:, 0]
    np.savez(
        path,
        frame_id=frames["frame_id"].to_numpy(),
        pixels=np.stack(pixels),
        poses=numbers(frames, *other_readers.POSE),
        errors=errors[np.isfinite(errors)],
    )
    return path


def test_pyarrow_reads_what_we_read(with_failure, tmp_path):
    expected = np.load(expected_of(with_failure, tmp_path / "expected.npz"))
    frames, scores, mean = other_readers.with_pyarrow(with_failure)
    assert [row["frame_id"] for row in frames] == expected["frame_id"].tolist()
    assert [[row[name] for name in other_readers.POSE] for row in frames] == expected["poses"].tolist()
    assert sorted(row["status"] for row in scores) == ["ok", "points_missing"]
    assert mean == pytest.approx(expected["errors"].mean(), rel=1e-12)


@pytest.mark.full
def test_other_libraries_read_what_we_read(with_failure, tmp_path):
    """In an environment of their own: the name `datasets` is Hugging Face's there, and ours here."""
    expected = expected_of(with_failure, tmp_path / "expected.npz")
    script = Path(shutil.copy(other_readers.__file__, tmp_path))
    venv.create(tmp_path / "theirs", with_pip=True)
    python = tmp_path / "theirs" / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    torch = os.environ.get(TORCH, "")
    subprocess.run([python, "-m", "pip", "install", "--quiet", *PACKAGES, *torch.split()], check=True)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    environment |= {"HF_HOME": str(tmp_path / "cache"), "HF_HUB_OFFLINE": "1"}
    for library in ("pyarrow", "pandas", "polars", "duckdb", "datasets", *(["torch"] if torch else [])):
        words = [python, script, with_failure, expected, library]
        done = subprocess.run(words, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert done.stdout.endswith(f"{library}: equal\n")

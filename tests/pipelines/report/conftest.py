"""The tiny dataset with its report, whose figures take seconds."""

from __future__ import annotations

import shutil

import pytest

from datasets.store.dataset import open_dataset
from pipelines.report.page import write_report


@pytest.fixture(scope="session")
def reported(tiny, tmp_path_factory):
    """The folder of the dataset with a report of all its kinds of estimates, which no test may change."""
    root = tmp_path_factory.mktemp("reported") / "dataset"
    shutil.copytree(tiny[1], root)
    write_report(open_dataset(root))
    return root

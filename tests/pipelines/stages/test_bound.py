"""The bound and `photometric` through the command line: rows in the tables, lines in the report, the same bits."""

import numpy as np
import pytest

from datasets.rows import pose_covariances
from datasets.store.dataset import open_dataset
from pipelines.report.page import REPORT
from pipelines.report.pixel_bound import bound_rows
from tests.own import image_rows


@pytest.mark.full
@pytest.mark.usefixtures("no_figures")
def test_photometric_and_the_bound_come_out_in_tables_and_report(root, cli, content):
    for words in (("estimate", root, "--estimator", "photometric"), ("bound", root), ("score", root)):
        assert cli(*words, "-q").code == 0
    assert cli("report", root).code == 0
    assert [row["status"] for row in image_rows(root, "estimates", "photometric")] == ["ok", "ok"]
    dataset = open_dataset(root)
    bound = pose_covariances(dataset.read("bounds"))
    assert np.all(np.linalg.eigvalsh(bound) > 0.0)
    over = {row["setting"]: row["over"] for row in bound_rows(dataset)}
    # The tiny pictures have no noise but rounding, and four cells a pixel: corners are far from it, pixels nearer.
    assert over["photometric image exact all"] < over["best detected exact all"]
    text = (root / REPORT).read_text()
    assert "Pose errors over the pixels" in text
    assert "photometric image exact all" in text
    digest = content(root)
    assert cli("estimate", root, "--estimator", "photometric", "-q", "--overwrite", "--workers", 2).code == 0
    assert cli("score", root, "-q").code == 0
    assert content(root) == digest


def test_a_report_without_bounds_has_no_table_of_them(root):
    assert bound_rows(open_dataset(root)) == []

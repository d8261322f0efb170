"""Tables with right digests whose numbers cannot be: the report and a comparison leave out what they cannot use."""

from __future__ import annotations

import pyarrow as pa
import pytest

from datasets.store.shard_file import read_rows
from tests.hostile.kinds.tables import write
from tests.wrong_input import first

CASES = {
    "negative variances": ("detections", "var_x_px2", -1.0),
    "no variances": ("detections", "var_y_px2", 0.0),
    "large correlations": ("detections", "cov_xy_px2", 1e6),
    "equal covariances": ("estimates", "covariance", [1e30] * 36),
    "negative covariances": ("estimates", "covariance", [-1.0] * 36),
    "unknown angles": ("keypoints", "theta_deg", None),
    "another detector for one shard": ("detections", "detector", ""),
    "another detector for one point": ("detections", "detector", ""),
}
IN_FIGURES = ("estimates",)  # and in what is made from them; no number of the other tables is drawn
ONE_ROW = ("another detector for one point",)  # elsewhere every row is changed


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("case", CASES)
def test_the_report_and_a_comparison_end(case, root, cli, request):
    table, name, value = CASES[case]
    if table not in IN_FIGURES:
        request.getfixturevalue("no_figures")
    path = first(root, table)
    rows = read_rows(path)
    index = rows.column_names.index(name)
    field = rows.schema.field(name).with_nullable(True)
    kept = rows[name].to_pylist()[:-1] if case in ONE_ROW else []
    changed = pa.array([*kept, *[value] * (rows.num_rows - len(kept))], field.type)
    footer = {key.decode(): text.decode() for key, text in rows.schema.metadata.items()}
    write(path, rows.set_column(index, field, changed).replace_schema_metadata(None), footer)
    for words in (("score", root, "-q"), ("report", root), ("compare", root, root)):
        done = cli(*words)
        assert done.code in (0, 2), done.err

"""Medians of many values from those that are kept."""

import numpy as np
import pytest

from pipelines.report import sample
from pipelines.report.sample import Sample


def filled(values, sizes):
    found, start = Sample(), 0
    for size in sizes:
        found.add(values[start : start + size])
        start += size
    return found


def test_few_values_are_all_kept():
    values = np.random.default_rng(0).standard_normal(1001)
    assert filled(values, [0, 400, 1, 600]).median() == np.median(values)
    assert np.isnan(Sample().median())


@pytest.mark.parametrize("sizes", [[1000], [7] * 142 + [6], [999, 1], [100] * 10])
def test_of_many_every_nth_is_kept_however_they_come(sizes, monkeypatch):
    monkeypatch.setattr(sample, "MOST", 100)
    values = np.arange(1000.0)
    found = filled(values, sizes)
    assert found.step in (16, 8, 32)
    np.testing.assert_array_equal(np.concatenate(found.parts), values[:: found.step])
    assert sum(map(len, found.parts)) <= 100

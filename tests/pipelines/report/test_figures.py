"""Figures of many frames show a spread of them."""

import numpy as np
import pytest
from matplotlib.cbook import boxplot_stats

from pipelines.report import figures


def test_few_rows_are_all_drawn_and_many_at_equal_distances():
    rows = np.arange(10, 110)
    assert figures._spread(rows, 100) is rows
    drawn = figures._spread(rows, 10)
    assert drawn.tolist() == [10, 21, 32, 43, 54, 65, 76, 87, 98, 109]


@pytest.mark.parametrize("count", [50, 20_000])
def test_a_box_is_that_of_all_values_and_shows_the_outermost_outliers(count):
    values = np.random.default_rng(1).standard_cauchy(count)
    (whole,), found = boxplot_stats(values), figures._box(values)
    assert [found[name] for name in ("q1", "med", "q3")] == [whole[name] for name in ("q1", "med", "q3")]
    outliers = np.sort(whole["fliers"])
    assert len(found["fliers"]) == min(len(outliers), figures.MOST_OUTLIERS)
    assert (found["fliers"].min(), found["fliers"].max()) == (outliers[0], outliers[-1])

"""Tables: which columns are sorted as numbers."""

from pipelines.pages.numbers import NONE
from pipelines.pages.sections import Table


def test_a_column_of_numbers_and_gaps_is_numeric():
    table = Table("t", ("name", "value", "mixed", "none"), (("a", "1.5 [1, 2]", "3", ""), ("b", NONE, "three", NONE)))
    assert table.numeric == (False, True, False, False)
    assert [table.value(cell) for cell in ("1.5 [1, 2]", NONE)] == ["1.5", ""]

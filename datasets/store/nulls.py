"""Numbers that are not there: nulls in tables, which every reader leaves out of its averages; NaN in our arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa

from eposit.arrays import Array


def with_nulls(rows: pa.Table) -> pa.Table:
    """The same rows with null for every NaN, and for a list of NaN alone."""
    for i, field in enumerate(rows.schema):
        if pa.types.is_floating(field.type):
            rows = rows.set_column(i, field, _null_where_nan(with_nans(rows.column(i)), field.type))
        elif is_list_of_floats(field.type):
            values = with_nans(rows.column(i))
            flat, nothing = _null_where_nan(values.ravel(), field.type.value_type), np.isnan(values).all(axis=1)
            lists = pa.FixedSizeListArray.from_arrays(flat, type=field.type, mask=pa.array(nothing))
            rows = rows.set_column(i, field, lists)
    return rows


def with_nans(column: Any) -> Array:
    """(n,) float64 of a column of floats, or (n, k) of one of lists of k floats, with NaN for every null."""
    column = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    if not is_list_of_floats(column.type):
        return np.asarray(column.to_numpy(zero_copy_only=False), np.float64)
    values = np.full((len(column), column.type.list_size), np.nan)
    there = column.is_valid().to_numpy(zero_copy_only=False)
    values[there] = with_nans(column.drop_null().flatten()).reshape(-1, column.type.list_size)
    return values


def is_list_of_floats(kind: pa.DataType) -> bool:
    """Whether values of a type are lists of a fixed number of floats."""
    return pa.types.is_fixed_size_list(kind) and pa.types.is_floating(kind.value_type)


def is_ragged_list_of_floats(kind: pa.DataType) -> bool:
    """Whether values of a type are lists of any number of floats. They hold no NaN; what is not there is a null."""
    return pa.types.is_list(kind) and pa.types.is_floating(kind.value_type)


def _null_where_nan(values: Array, kind: pa.DataType) -> pa.Array:
    return pa.array(values, type=kind, mask=np.isnan(values))

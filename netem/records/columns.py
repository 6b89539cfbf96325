"""Columns of Parquet files from Python values.

`pyarrow.array` imports pandas wherever it is installed, which costs each run half a second of processor time and 50 MB.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import pyarrow as pa

NAME: Final = pa.dictionary(pa.int32(), pa.string())


def column_of(kind: pa.DataType, values: Sequence[Any]) -> pa.Array:
    """Return `values`, without None, as a column of type `kind`: `NAME`, or Arrow's int64, bool, string or binary.

    Raises TypeError or AttributeError for a value of another type, OverflowError for an integer beyond 64 bits.
    """
    if kind == NAME:
        codes: dict[str, int] = {}
        numbers = array("i", [codes.setdefault(value, len(codes)) for value in values])
        return pa.DictionaryArray.from_arrays(_plain(pa.int32(), numbers), _texts(pa.string(), list(codes)))
    if pa.types.is_int64(kind):
        return _plain(kind, array("q", values))
    if pa.types.is_boolean(kind):
        bits = np.packbits(np.array(values, np.bool_), bitorder="little")
        return pa.Array.from_buffers(kind, len(values), [None, pa.py_buffer(bits.tobytes())])
    return _texts(kind, values)


def _plain(kind: pa.DataType, numbers: array[int]) -> pa.Array:
    return pa.Array.from_buffers(kind, len(numbers), [None, pa.py_buffer(numbers.tobytes())])


def _texts(kind: pa.DataType, values: Sequence[Any]) -> pa.Array:
    pieces = [value.encode() for value in values] if pa.types.is_string(kind) else values
    ends = np.zeros(len(values) + 1, np.int32)
    np.cumsum(np.fromiter(map(len, pieces), np.int64, len(values)), out=ends[1:])
    return pa.Array.from_buffers(kind, len(values), [None, pa.py_buffer(ends), pa.py_buffer(b"".join(pieces))])

"""The ledger's Parquet file, written chunk by chunk.

Columns are those of `ledger.COLUMNS`; names and fates are dictionary-encoded, times are int64 nanoseconds from the
start of the run with the unit in the field's metadata, -1 where the instant does not exist. The file's metadata holds
`marconet.hash`, `marconet.rows`, `marconet.expected` and what the run adds (`marconet.scenario`, `marconet.seed`).

Not modelled: a file whose writer was killed has no footer, and Parquet cannot read such a file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

PREFIX = "marconet."
NAME = pa.dictionary(pa.int32(), pa.string())
NS = {"unit": "ns"}
SCHEMA = pa.schema([
    pa.field("medium", NAME, nullable=False),
    pa.field("sender", NAME, nullable=False),
    pa.field("number", pa.int64(), nullable=False),
    pa.field("receiver", NAME, nullable=False),
    pa.field("copy", pa.int64(), nullable=False),
    pa.field("offered_ns", pa.int64(), nullable=False, metadata=NS),
    pa.field("on_air_ns", pa.int64(), nullable=False, metadata=NS),
    pa.field("end_ns", pa.int64(), nullable=False, metadata=NS),
    pa.field("delivered_ns", pa.int64(), nullable=False, metadata=NS),
    pa.field("size_bytes", pa.int64(), nullable=False, metadata={"unit": "byte"}),
    pa.field("digest", pa.binary(), nullable=False),
    pa.field("fate", NAME, nullable=False),
    pa.field("cause", NAME, nullable=False),
])


class ParquetLedger:
    """An open ledger file; `finish` makes it readable."""

    def __init__(self, path: Path, metadata: Mapping[str, str]) -> None:
        self._writer = pq.ParquetWriter(path, SCHEMA, compression="zstd")
        self._writer.add_key_value_metadata({PREFIX + key: value for key, value in metadata.items()})

    def write(self, rows: Sequence[tuple[Any, ...]]) -> None:
        columns = [_array(field.type, values) for field, values in zip(SCHEMA, zip(*rows, strict=True), strict=True)]
        self._writer.write_batch(pa.RecordBatch.from_arrays(columns, schema=SCHEMA))

    def finish(self, **facts: str | int) -> None:
        self._writer.add_key_value_metadata({PREFIX + key: str(value) for key, value in facts.items()})
        self._writer.close()


def _array(kind: pa.DataType, values: Sequence[Any]) -> pa.Array:
    if pa.types.is_dictionary(kind):
        return pa.array(values, kind.value_type).dictionary_encode()
    return pa.array(values, kind)

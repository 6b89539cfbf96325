"""The ledger's Parquet file: the writer, and the reader of rows, metadata and the hash computed from the rows.

Columns are those of `ledger.COLUMNS`; names and fates are dictionary-encoded, times are int64 nanoseconds from the
start of the run, -1 if the instant does not exist. The file's metadata holds `marconet.hash`, `marconet.rows`,
`marconet.expected` and the entries of the run (`marconet.scenario`, `marconet.seed`). File and journal,
`ledger.rows.part`, are those of row_file.py.

A row takes little more than its digest and the times that do not repeat (decision 0014).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import pyarrow as pa
import pyarrow.parquet as pq

from netem.records.columns import NAME
from netem.records.journal import journal_of
from netem.records.ledger_hash import LedgerHash
from netem.records.row_file import PREFIX, RowFile, RowFormat, Rows

SCHEMA = pa.schema([
    pa.field("medium", NAME, nullable=False),
    pa.field("sender", NAME, nullable=False),
    pa.field("number", pa.int64(), nullable=False),
    pa.field("receiver", NAME, nullable=False),
    pa.field("copy", pa.int64(), nullable=False),
    pa.field("offered_ns", pa.int64(), nullable=False),
    pa.field("on_air_ns", pa.int64(), nullable=False),
    pa.field("end_ns", pa.int64(), nullable=False),
    pa.field("delivered_ns", pa.int64(), nullable=False),
    pa.field("size_bytes", pa.int64(), nullable=False),
    pa.field("digest", pa.binary(), nullable=False),
    pa.field("fate", NAME, nullable=False),
    pa.field("cause", NAME, nullable=False),
])
FORMAT: Final = RowFormat(SCHEMA)


class LedgerFile(RowFile):
    """Writes the ledger at `path` and, until `finish`, its journal."""

    def __init__(self, path: Path, metadata: Mapping[str, str]) -> None:
        super().__init__(path, FORMAT, metadata)


def noted_batches(path: Path) -> Iterator[pa.RecordBatch]:
    """Yield the rows in the journal of the ledger at `path`, up to its last whole piece."""
    return FORMAT.noted_batches(path)


def write_from_journal(path: Path, metadata: Mapping[str, str]) -> None:
    """Write the ledger at `path` from its journal and remove the journal. On OSError the journal remains."""
    FORMAT.write_from_journal(path, metadata)


def batch_of(rows: Rows) -> pa.RecordBatch:
    return FORMAT.batch_of(rows)


def read_ledger(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """Return the rows in the order in which they were closed, with `columns` or all columns; see `RowFormat.read`."""
    return FORMAT.read(path, columns)


def read_metadata(path: Path) -> dict[str, str]:
    """Return the file's metadata: hash, rows, expected, and the entries of the run (scenario, seed).

    It is empty if the run was killed before the file was written.
    """
    if not path.exists() and journal_of(path).exists():
        return {}
    found = pq.read_metadata(path).metadata or {}
    return {key.decode().removeprefix(PREFIX): value.decode() for key, value in found.items()
            if key.decode().startswith(PREFIX)}


def hash_of(path: Path) -> str:
    """Return the hash computed from the rows; it equals that in the metadata unless the rows were changed."""
    total = LedgerHash(SCHEMA.names)
    for batch in FORMAT.batches(path):
        columns = [column.to_pylist() for column in batch.columns]
        total.add(list(zip(*columns, strict=True)))
    return total.hex()

"""Reads a ledger: rows, metadata, and the hash computed from the rows.

A run that was killed leaves no Parquet file but the journal of its rows, which is read up to its last whole piece and
has no metadata.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from netem.records.ledger_file import NAMES, PREFIX, SCHEMA, journal_of, noted_batches
from netem.records.ledger_hash import LedgerHash


def read_ledger(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """Return the rows in the order in which they were closed, with `columns` or all columns.

    Text columns are dictionary-encoded, with one dictionary for all chunks. Raises FileNotFoundError if neither the
    file nor its journal exists.
    """
    if path.exists() or not journal_of(path).exists():
        with pq.ParquetFile(path, read_dictionary=NAMES) as file:
            return file.read(None if columns is None else list(columns), use_threads=False).unify_dictionaries()
    table = pa.Table.from_batches(noted_batches(path), schema=SCHEMA).unify_dictionaries()
    return table if columns is None else table.select(columns)


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
    for batch in _batches(path):
        columns = [column.to_pylist() for column in batch.columns]
        total.add(list(zip(*columns, strict=True)))
    return total.hex()


def _batches(path: Path) -> Iterator[pa.RecordBatch]:
    if path.exists() or not journal_of(path).exists():
        yield from pq.ParquetFile(path).iter_batches()
    else:
        yield from noted_batches(path)

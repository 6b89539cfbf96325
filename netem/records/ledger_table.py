"""Reading a ledger file back: rows, metadata, and the hash computed again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from netem.records.ledger_file import PREFIX
from netem.records.ledger_hash import LedgerHash


def read_ledger(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """The rows in the order in which they were closed; `columns`: only these. Text columns are dictionary-encoded, with
    one dictionary for all chunks."""
    with pq.ParquetFile(path) as file:
        return file.read(None if columns is None else list(columns), use_threads=False).unify_dictionaries()


def read_metadata(path: Path) -> dict[str, str]:
    """What the file says about its run: hash, rows, expected, and what the run added (scenario, seed)."""
    found = pq.read_metadata(path).metadata or {}
    return {key.decode().removeprefix(PREFIX): value.decode() for key, value in found.items()
            if key.decode().startswith(PREFIX)}


def hash_of(path: Path) -> str:
    """The hash computed again from the rows: equal to the one in the metadata unless the rows were changed."""
    file = pq.ParquetFile(path)
    total = LedgerHash(file.schema_arrow.names)
    for batch in file.iter_batches():
        columns = [column.to_pylist() for column in batch.columns]
        total.add(list(zip(*columns, strict=True)))
    return total.hex()

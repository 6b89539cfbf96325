"""The ledger's Parquet file: the writer, and the reader of rows, metadata and the hash computed from the rows.

The file is written row group by row group and gets its final name when it is whole.

Columns are those of `ledger.COLUMNS`; names and fates are dictionary-encoded, times are int64 nanoseconds from the
start of the run, -1 if the instant does not exist. Arrow's own copy of the schema, 1.6 kB, is left out; a reader asks
for names as dictionaries, as `read_ledger` does. The file's metadata holds `marconet.hash`, `marconet.rows`,
`marconet.expected` and the entries of the run (`marconet.scenario`, `marconet.seed`).

Integers are stored as packed differences and digests without their lengths, so that a row takes little more than its
digest and the times that do not repeat (decision 0014).

A Parquet file cannot be read before its end is written. During the run the rows are therefore also in a journal,
`ledger.rows.part`. A run that was killed leaves only the journal, which is read up to its last whole piece and has no
metadata.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from netem.records.journal import GrowingFile, Journal, journal_of, pieces_of
from netem.records.ledger_hash import LedgerHash
from netem.records.part_file import part_of, publish

PREFIX = "marconet."
NAME = pa.dictionary(pa.int32(), pa.string())
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
ENCODINGS: Final = {field.name: "DELTA_BINARY_PACKED" for field in SCHEMA if field.type == pa.int64()} | {
    "digest": "DELTA_LENGTH_BYTE_ARRAY"}
NAMES: Final = [field.name for field in SCHEMA if field.type == NAME]
Rows = Sequence[Sequence[Any]]


class LedgerFile:
    """Writes the ledger at `path` and, until `finish`, its journal."""

    def __init__(self, path: Path, metadata: Mapping[str, str]) -> None:
        self._path = path
        self._journal = Journal(journal_of(path))
        self._file = GrowingFile(part_of(path))
        self._writer = _writer(self._file, metadata)

    def note(self, encoded_rows: bytes) -> None:
        """Add rows, a MessagePack array, to the journal. On OSError, as for a full disk, the next call writes them."""
        self._journal.add(encoded_rows)
        self._journal.commit()

    def write(self, rows: Rows) -> None:
        """Add rows to the file. On a full disk they wait in memory; the journal, written before, raises the error."""
        self._writer.write_batch(batch_of(rows))
        with suppress(OSError):
            self._file.commit()

    def finish(self, unnoted: bytes, **facts: str | int) -> None:
        """Close the file and remove the journal.

        `unnoted` holds the rows that the journal does not have yet, as `note` takes them. On OSError, as for a full
        disk, the file is removed; the journal stays, and `unnoted` is added to it if there is room for it now.
        """
        self._writer.add_key_value_metadata({PREFIX + key: str(value) for key, value in facts.items()})
        self._writer.close()
        try:
            self._file.commit()
        except OSError:
            part_of(self._path).unlink()
            with suppress(OSError):
                if unnoted:
                    self._journal.add(unnoted)
                self._journal.commit()
            raise
        finally:
            self._journal.close()
            self._file.close()
        publish(self._path)
        journal_of(self._path).unlink()


def noted_batches(path: Path) -> Iterator[pa.RecordBatch]:
    """Yield the rows in the journal of the ledger at `path`, up to its last whole piece."""
    decode = msgspec.msgpack.Decoder(list[list[Any]]).decode
    for piece in pieces_of(journal_of(path)):
        yield batch_of(decode(piece))


def write_from_journal(path: Path, metadata: Mapping[str, str]) -> None:
    """Write the ledger at `path` from its journal and remove the journal. On OSError the journal remains."""
    file = GrowingFile(part_of(path))
    try:
        writer = _writer(file, metadata)
        for batch in noted_batches(path):
            writer.write_batch(batch)
            file.commit()
        writer.close()
        file.commit()
    except OSError:
        part_of(path).unlink()
        raise
    finally:
        file.close()
    publish(path)
    journal_of(path).unlink()


def _writer(file: GrowingFile, metadata: Mapping[str, str]) -> pq.ParquetWriter:
    writer = pq.ParquetWriter(pa.PythonFile(file, mode="w"), SCHEMA, compression="zstd", compression_level=3,
                              write_statistics=False, column_encoding=ENCODINGS, use_dictionary=NAMES,
                              store_schema=False)
    writer.add_key_value_metadata({PREFIX + key: value for key, value in metadata.items()})
    return writer


def batch_of(rows: Rows) -> pa.RecordBatch:
    columns = [_array(field.type, values) for field, values in zip(SCHEMA, zip(*rows, strict=True), strict=True)]
    return pa.RecordBatch.from_arrays(columns, schema=SCHEMA)


def _array(kind: pa.DataType, values: Sequence[Any]) -> pa.Array:
    if pa.types.is_dictionary(kind):
        return pa.array(values, kind.value_type).dictionary_encode()
    return pa.array(values, kind)


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

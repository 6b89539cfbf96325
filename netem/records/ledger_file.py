"""The ledger on the disk: a stream of batches while the run goes on, a Parquet file when it has ended.

    write -> ledger.arrows.part (Arrow IPC, readable up to its last batch)    finish -> ledger.parquet

Columns are those of `ledger.COLUMNS`; names and fates are dictionary-encoded, times are int64 nanoseconds from the
start of the run with the unit in the field's metadata, -1 where the instant does not exist. The file's metadata holds
`marconet.hash`, `marconet.rows`, `marconet.expected` and what the run adds (`marconet.scenario`, `marconet.seed`).

Integers are stored as packed differences and digests without their lengths: what is left of a row are the digest and
the times that do not repeat (decision 0014).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

from netem.records.batch_stream import BatchStream, batches_of
from netem.records.part_file import part_of, publish

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
ROW_GROUP_ROWS: Final = 131_072
ENCODINGS: Final = {field.name: "DELTA_BINARY_PACKED" for field in SCHEMA if field.type == pa.int64()} | {
    "digest": "DELTA_LENGTH_BYTE_ARRAY"}


def stream_of(path: Path) -> Path:
    """The stream of the ledger that will be at `path`, as long as the run goes on."""
    return part_of(path.with_suffix(".arrows"))


class LedgerFile:
    """The ledger that `finish` leaves at `path`."""

    def __init__(self, path: Path, metadata: Mapping[str, str]) -> None:
        self._path = path
        self._metadata = dict(metadata)
        self._stream = BatchStream(stream_of(path), SCHEMA)

    def add(self, rows: Sequence[tuple[Any, ...]]) -> None:
        self._stream.add(rows)

    def commit(self) -> None:
        """Put what was added on the disk. OSError, as for a full disk, leaves the stream as it was."""
        self._stream.commit()

    def finish(self, **facts: str | int) -> None:
        """Turn the stream into the Parquet file. OSError, as for a full disk, leaves the stream."""
        try:
            self._stream.commit()
        finally:
            self._stream.close()
        to_parquet(self._path, self._metadata | {key: str(value) for key, value in facts.items()})


def to_parquet(path: Path, metadata: Mapping[str, str]) -> None:
    """Write the ledger at `path` from its stream, a row group at a time, and remove the stream."""
    write_parquet(path, batches_of(stream_of(path)), metadata)
    stream_of(path).unlink()


def write_parquet(path: Path, batches: Iterable[pa.RecordBatch], metadata: Mapping[str, str]) -> None:
    """Write batches of SCHEMA to `path`; the file appears whole or not at all."""
    part = part_of(path)
    try:
        with pq.ParquetWriter(part, SCHEMA, compression="zstd", compression_level=3, write_statistics=False,
                              use_dictionary=[field.name for field in SCHEMA if field.type == NAME],
                              column_encoding=ENCODINGS) as writer:
            writer.add_key_value_metadata({PREFIX + key: value for key, value in metadata.items()})
            for group in _row_groups(batches):
                writer.write_table(group, row_group_size=ROW_GROUP_ROWS)
        publish(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def _row_groups(batches: Iterable[pa.RecordBatch]) -> Iterator[pa.Table]:
    """Tables of at least ROW_GROUP_ROWS rows, the last of what is left: a stream kept often has small batches."""
    waiting: list[pa.RecordBatch] = []
    rows = 0
    for batch in batches:
        waiting.append(batch)
        rows += batch.num_rows
        if rows >= ROW_GROUP_ROWS:
            yield pa.Table.from_batches(waiting).unify_dictionaries()
            waiting, rows = [], 0
    if waiting:
        yield pa.Table.from_batches(waiting).unify_dictionaries()

"""Rows that are on the disk soon: an Arrow IPC stream of record batches, readable up to its last whole batch.

The writer adds one batch after the other; when its process is killed the file ends somewhere in a batch, and
`batches_of` yields those before it. Text columns are dictionary-encoded per batch.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import pyarrow as pa

from netem.records.journal import Journal

OPTIONS: Final = pa.ipc.IpcWriteOptions(compression="lz4")


class BatchStream:
    """The open file at `path`, for rows of `schema`."""

    def __init__(self, path: Path, schema: pa.Schema) -> None:
        self._schema = schema
        self._journal = Journal(path)
        self._writer = pa.ipc.new_stream(pa.PythonFile(self._journal, mode="w"), schema, options=OPTIONS)

    def add(self, rows: Sequence[tuple[Any, ...]]) -> None:
        """Add one batch, in memory."""
        columns = [_array(field.type, values)
                   for field, values in zip(self._schema, zip(*rows, strict=True), strict=True)]
        self._writer.write_batch(pa.RecordBatch.from_arrays(columns, schema=self._schema))

    def commit(self) -> None:
        """Put the batches added on the disk. OSError, as for a full disk, leaves the file with those before."""
        self._journal.commit()

    def close(self) -> None:
        """Close the file as it is: it ends with its last whole batch and needs no mark of its end."""
        self._journal.close()


def batches_of(path: Path) -> Iterator[pa.RecordBatch]:
    """The whole batches of the file at `path`, in order. FileNotFoundError if there is none."""
    with path.open("rb") as file:
        try:
            reader = pa.ipc.open_stream(file)
        except (pa.ArrowException, OSError):
            return                                  # cut off within the schema
        while True:
            try:
                batch = reader.read_next_batch()
            except (StopIteration, pa.ArrowException, OSError):
                return
            yield batch


def _array(kind: pa.DataType, values: Sequence[Any]) -> pa.Array:
    if pa.types.is_dictionary(kind):
        return pa.array(values, kind.value_type).dictionary_encode()
    return pa.array(values, kind)

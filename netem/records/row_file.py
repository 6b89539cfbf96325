"""Rows of a run in a Parquet file that grows with the run: writer, journal and reader.

The file is written row group by row group and gets its final name when it is whole.

A Parquet file cannot be read before its end is written. During the run the rows are therefore also in a journal,
`NAME.rows.part`, as MessagePack. A run that was killed leaves only the journal, which is read up to its last whole
piece and has no metadata.

Integers are stored as packed differences and bytes without their lengths between them (decision 0014). Arrow's own copy
of the schema, 1.6 kB, is left out; `RowFormat.read` asks for names as dictionaries instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from netem.records.columns import NAME, column_of
from netem.records.journal import GrowingFile, Journal, journal_of, pieces_of
from netem.records.part_file import part_of, publish

PREFIX: Final = "marconet."
Rows = Sequence[Sequence[Any]]


@dataclass(frozen=True)
class RowFormat:
    """The columns of a file of rows. Columns of the type `NAME` are dictionary-encoded."""

    schema: pa.Schema

    @cached_property
    def names(self) -> list[str]:
        return [field.name for field in self.schema if field.type == NAME]

    @cached_property
    def encodings(self) -> dict[str, str]:
        return {field.name: "DELTA_LENGTH_BYTE_ARRAY" if pa.types.is_binary(field.type) else "DELTA_BINARY_PACKED"
                for field in self.schema if field.type != NAME}

    def batch_of(self, rows: Rows) -> pa.RecordBatch:
        columns = [column_of(field.type, values)
                   for field, values in zip(self.schema, zip(*rows, strict=True), strict=True)]
        return pa.RecordBatch.from_arrays(columns, schema=self.schema)

    def writer(self, file: GrowingFile, metadata: Mapping[str, str]) -> pq.ParquetWriter:
        writer = pq.ParquetWriter(pa.PythonFile(file, mode="w"), self.schema, compression="zstd", compression_level=3,
                                  write_statistics=False, column_encoding=self.encodings, use_dictionary=self.names,
                                  store_schema=False)
        writer.add_key_value_metadata({PREFIX + key: value for key, value in metadata.items()})
        return writer

    def noted_batches(self, path: Path) -> Iterator[pa.RecordBatch]:
        """Yield the rows in the journal of the file at `path`, up to its last whole piece."""
        decode = msgspec.msgpack.Decoder(list[list[Any]]).decode
        for piece in pieces_of(journal_of(path)):
            yield self.batch_of(decode(piece))

    def batches(self, path: Path) -> Iterator[pa.RecordBatch]:
        """Yield the rows in order, some at a time, of the file at `path` or, without one, of its journal."""
        if path.exists() or not journal_of(path).exists():
            with pq.ParquetFile(path, read_dictionary=self.names) as file:
                yield from file.iter_batches()
        else:
            yield from self.noted_batches(path)

    def read(self, path: Path, columns: Sequence[str] | None = None) -> pa.Table:
        """Return the rows in order, with `columns` or all columns.

        Text columns are dictionary-encoded, with one dictionary for all chunks. Raises FileNotFoundError if neither the
        file nor its journal exists.
        """
        if path.exists() or not journal_of(path).exists():
            with pq.ParquetFile(path, read_dictionary=self.names) as file:
                return file.read(None if columns is None else list(columns), use_threads=False).unify_dictionaries()
        table = pa.Table.from_batches(self.noted_batches(path), schema=self.schema).unify_dictionaries()
        return table if columns is None else table.select(columns)

    def write_from_journal(self, path: Path, metadata: Mapping[str, str]) -> None:
        """Write the file at `path` from its journal and remove the journal. On OSError the journal remains."""
        file = GrowingFile(part_of(path))
        try:
            writer = self.writer(file, metadata)
            for batch in self.noted_batches(path):
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


class RowFile:
    """Writes rows to the file at `path` and, until `finish`, to its journal."""

    def __init__(self, path: Path, layout: RowFormat, metadata: Mapping[str, str]) -> None:
        self._path = path
        self._format = layout
        self._journal = Journal(journal_of(path))
        self._file = GrowingFile(part_of(path))
        self._writer = layout.writer(self._file, metadata)

    def note(self, encoded_rows: bytes) -> None:
        """Add rows, a MessagePack array, to the journal. On OSError, as for a full disk, the next call writes them."""
        self._journal.add(encoded_rows)
        self._journal.commit()

    def write(self, rows: Rows) -> None:
        """Add rows to the file. On a full disk they wait in memory; the journal, written before, raises the error."""
        self._writer.write_batch(self._format.batch_of(rows))
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

"""The rows of a ledger in memory, for a run of which only figures and the hash remain.

It stands where the ledger has its file. Full chunks become Arrow arrays, some 100 bytes a row, so that a long run needs
a third of the memory that its rows would take; the rows of the last chunk stay as they are, as a short run asks for few
of their columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pyarrow as pa

from netem.records.ledger import CHUNK_ROWS
from netem.records.ledger_file import SCHEMA, LedgerFile, batch_of
from netem.records.row_file import Rows


class LedgerInMemory(LedgerFile):
    """`rows` are those that are in no chunk."""

    def __init__(self) -> None:
        self._chunks: list[pa.RecordBatch] = []
        self.rows: Sequence[Any] = ()

    def note(self, encoded_rows: bytes) -> None:
        """Do nothing: there is no journal."""

    def write(self, rows: Rows) -> None:
        """Take settled rows, of which the ledger lets go."""
        self.rows = [*self.rows, *rows] if self.rows else rows
        if len(self.rows) >= CHUNK_ROWS // 2:
            self._chunks.append(batch_of(self.rows))
            self.rows = ()

    def finish(self, unnoted: bytes, **facts: str | int) -> None:
        """Do nothing: the rows have been written."""

    @property
    def few(self) -> bool:
        """Whether all rows are in `rows`, as there are not enough for a chunk."""
        return not self._chunks

    def table(self) -> pa.Table:
        """Return all rows, whose order is that of the ledger."""
        return pa.Table.from_batches([*self._chunks, batch_of(self.rows)] if self.rows else self._chunks, schema=SCHEMA)

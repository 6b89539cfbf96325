"""What became of each frame: the fates of its copies, looked up in the ledger of a run.

The ledger stays in columns, 40 bytes a copy; its rows are sorted by frame once, and each frame is one stretch of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import pyarrow as pa

from netem.records.ledger_file import read_ledger

COLUMNS: Final = ("medium", "sender", "number", "receiver", "copy", "delivered_ns", "fate", "cause")


class CopyFate(NamedTuple):
    receiver: str
    copy: int               # 0 the original, 1.. duplicates
    delivered_ns: int       # -1: it did not arrive
    fate: str
    cause: str


class FrameFates:
    """The copies in the ledger at `path`, by frame."""

    def __init__(self, path: Path) -> None:
        table = read_ledger(path, COLUMNS)
        self._names = {name: _names(table[name]) for name in ("medium", "sender", "receiver", "fate", "cause")}
        self._codes = {name: _codes(table[name]) for name in self._names}
        self._rank = {name: {value: rank for rank, value in enumerate(self._names[name])}
                      for name in ("medium", "sender")}
        self._values = {name: table[name].to_numpy() for name in ("copy", "delivered_ns")}
        keys = self._key(self._codes["medium"], self._codes["sender"], table["number"].to_numpy())
        self._order = np.argsort(keys, kind="stable")
        self._keys = keys[self._order]

    def of(self, medium: str, sender: str, number: int) -> Iterator[CopyFate]:
        """Yield the copies of a frame in the order in which they were closed; none for a frame without receivers."""
        codes = self._rank["medium"].get(medium), self._rank["sender"].get(sender)
        if codes[0] is None or codes[1] is None or number < 0:
            return
        key = self._key(codes[0], codes[1], number)
        first, last = np.searchsorted(self._keys, (key, key + 1))
        names, codes_of, values = self._names, self._codes, self._values
        for row in self._order[first:last].tolist():
            yield CopyFate(names["receiver"][codes_of["receiver"][row]], int(values["copy"][row]),
                           int(values["delivered_ns"][row]), names["fate"][codes_of["fate"][row]],
                           names["cause"][codes_of["cause"][row]])

    def _key(self, medium: Any, sender: Any, number: Any) -> Any:
        return (medium * len(self._names["sender"]) + sender) * 2**40 + number


def _names(column: pa.ChunkedArray) -> list[str]:
    return [] if not column.num_chunks else list(column.chunk(0).dictionary.to_pylist())


def _codes(column: pa.ChunkedArray) -> np.ndarray[Any, np.dtype[np.int64]]:
    chunks = [chunk.indices.to_numpy(zero_copy_only=False) for chunk in column.chunks]
    return np.concatenate(chunks).astype(np.int64) if chunks else np.empty(0, np.int64)

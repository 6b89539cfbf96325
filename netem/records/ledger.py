"""The ledger: one row per frame copy, with its times and exactly one fate.

Conservation is counted at two places that do not know each other: `expect` where copies come into being (a medium for
the intended receivers of a frame, a link for duplicates) and `close` where they end.

Invariants:
- rows stand in the order in which copies were closed, the emulator's event order, which does not depend on the host;
- the hash covers every column of every row in that order, and neither the scenario's name nor the size of a chunk.

Given a path the rows go to Parquet chunk by chunk and memory stays bounded; without one they stay in `rows`. `keep`
puts the rows of the chunk in a journal meanwhile, which costs little more than the hash, as it takes the same bytes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from mypy_extensions import mypyc_attr

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.ledger_hash import LedgerHash
from netem.records.uninterrupted import uninterrupted

if TYPE_CHECKING:
    from netem.records.ledger_file import LedgerFile

Row = tuple[str, str, int, str, int, int, int, int, int, int, bytes, str, str]
COLUMNS = ("medium", "sender", "number", "receiver", "copy", "offered_ns", "on_air_ns", "end_ns", "delivered_ns",
           "size_bytes", "digest", "fate", "cause")
CHUNK_ROWS = 131_072        # some 40 MB


class ConservationError(Exception):
    """Copies that came into being and copies that ended differ in number."""


@dataclass(frozen=True)
class LedgerResult:
    """What a finished ledger says: its hash and how many copies met which fate (fates in the order of `Fate`)."""

    hash: str
    rows: int
    expected: int
    by_fate: Mapping[str, int]
    by_medium: Mapping[str, Mapping[str, int]]


@mypyc_attr(allow_interpreted_subclasses=True)
class Ledger:
    """`path` is the Parquet file to write, `metadata` goes into it beside the hash (scenario, seed)."""

    def __init__(self, path: Path | None = None, *, metadata: Mapping[str, str] | None = None,
                 chunk_rows: int = CHUNK_ROWS) -> None:
        if chunk_rows < 1:
            raise ValueError(f"chunk_rows={chunk_rows}: a chunk holds at least 1 row")
        self._expected_of: Counter[str] = Counter()
        self._rows: list[Row] = []
        self._ended: Counter[tuple[str, str]] = Counter()       # (medium, fate) of the rows counted so far,
        self._counted = 0                                       # which are those written and so many of `_rows`
        self._kept = 0                                          # so many of `_rows` are hashed and in the journal
        self._hash = LedgerHash(COLUMNS)
        self._file = _open(path, metadata or {}) if path else None
        self._flush_at = chunk_rows if path else 1 << 62
        self._result: LedgerResult | None = None

    def expect(self, copies: int, medium: str = "") -> None:
        """Announce copies; with every medium named, a difference is blamed on its medium."""
        self._expected_of[medium] += copies

    def close(self, frame: Frame, receiver: str, fate: Fate, *, copy: int = 0, delivered_ns: int = -1,
              cause: str = "") -> None:
        """End one copy. `delivered_ns` is when it reached the node (-1: it did not); `cause` names what ended it."""
        rows = self._rows
        rows.append((frame.medium, frame.sender, frame.number, receiver, copy, frame.offered_ns, frame.on_air_ns,
                     frame.end_ns, delivered_ns, len(frame.data), frame.digest, fate._value_, cause))
        if len(rows) >= self._flush_at:
            self._flush()

    @property
    def expected(self) -> int:
        """Copies announced so far."""
        return self._expected_of.total()

    @property
    def closed(self) -> Counter[Fate]:
        """Copies closed so far, by fate."""
        total: Counter[Fate] = Counter()
        for fate, copies in self._by_fate().items():
            total[Fate(fate)] = copies
        return total

    @property
    def rows(self) -> Sequence[Row]:
        """The rows not yet written: all of them when the ledger has no path."""
        return self._rows

    def keep(self) -> None:
        """Put the rows closed so far in the journal, so that they outlive this process. OSError, as for a full disk,
        keeps them in memory for the next call."""
        if self._file is None or self._kept == len(self._rows):
            return
        with uninterrupted():
            encoded = self._hash.add(self._rows[self._kept:])
            self._kept = len(self._rows)
            self._file.note(encoded)

    def finish(self, *, complete: bool = True) -> LedgerResult:
        """Write what is left, close the file and check conservation.

        A run that was broken off passes `complete=False`: copies under way have no fate then, and nothing is checked.
        The file is whole in every case. Raises ConservationError; OSError, as for a full disk, leaves the journal with
        the rows kept so far.
        """
        if self._result is None:
            self._result = self._end()
        if complete:
            self._check(self._result)
        return self._result

    def _end(self) -> LedgerResult:
        by_medium: dict[str, dict[str, int]] = {}
        for (medium, fate), copies in sorted(self._counts().items(), key=lambda item: (item[0][0], _rank(item[0][1]))):
            by_medium.setdefault(medium, {})[fate] = copies
        by_fate = dict(sorted(self._by_fate().items(), key=lambda item: _rank(item[0])))
        with uninterrupted():               # else a second end would hash the same rows again
            unkept = self._rows[self._kept:]
            encoded = self._hash.add(unkept)
            self._kept = len(self._rows)
            if self._file is not None and self._rows:
                rows, self._rows, self._counted, self._kept = self._rows, [], 0, 0
                self._file.write(rows)
        if self._file is not None:
            self._file.finish(encoded if unkept else b"", hash=self._hash.hex(), rows=sum(by_fate.values()),
                              expected=self.expected)
        return LedgerResult(self._hash.hex(), sum(by_fate.values()), self.expected, by_fate, by_medium)

    def _check(self, result: LedgerResult) -> None:
        media = sorted(set(self._expected_of) | set(result.by_medium))
        counted = {medium: (self._expected_of[medium], sum(result.by_medium.get(medium, {}).values()))
                   for medium in media}
        named = not self._expected_of[""]
        wrong = {medium: pair for medium, pair in counted.items() if pair[0] != pair[1]} if named else {}
        if result.expected == result.rows and not wrong:
            return
        places = wrong or {"all media": (result.expected, result.rows)}
        differences = "; ".join(f"{place}: {expected} copies expected, {closed} closed ({closed - expected:+d})"
                                for place, (expected, closed) in places.items())
        raise ConservationError(f"ledger: {differences}: every copy ends in exactly one fate; closed: "
                                f"{dict(result.by_fate)}; look where the medium or its links announce or close copies")

    def _flush(self) -> None:
        if self._file is None or not self._rows:
            return
        self.keep()
        with uninterrupted():
            self._counts()
            rows, self._rows, self._counted, self._kept = self._rows, [], 0, 0
            self._file.write(rows)

    def _counts(self) -> Counter[tuple[str, str]]:
        """How the copies closed so far ended; what was counted before is not looked at again."""
        self._ended.update((row[0], row[11]) for row in islice(self._rows, self._counted, None))
        self._counted = len(self._rows)
        return self._ended

    def _by_fate(self) -> Counter[str]:
        total: Counter[str] = Counter()
        for (_, fate), copies in self._counts().items():
            total[fate] += copies
        return total


def _open(path: Path, metadata: Mapping[str, str]) -> LedgerFile:
    from netem.records.ledger_file import LedgerFile  # late: a ledger without a file needs no pyarrow

    return LedgerFile(path, metadata)


_ORDER = {fate.value: rank for rank, fate in enumerate(Fate)}


def _rank(fate: str) -> int:
    return _ORDER[fate]

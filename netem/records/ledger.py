"""The ledger: one row per frame copy, with its times and exactly one fate.

Conservation is checked by two independent counts: `expect` where copies are created (by a medium for the intended
receivers of a frame, by a link for duplicates) and `close` where they end.

A copy is closed when its medium or link decides about it, which may be long before it arrives. Until the emulator has
passed the arrival, the fate may change: to UNFINISHED if the run ends first, to RECEIVER_GONE or RECEIVER_PAUSED if the
receiver's node does not take it. `keep`, a full chunk and `finish` settle fates; a settled fate is final.

Invariants:
- rows are in the order in which copies were closed, the emulator's event order, which does not depend on the host;
- the hash covers every column of every row in that order, and neither the scenario's name nor the size of a chunk;
- hash, journal, file and listeners get settled rows only, in order: a row that is not settled holds back later ones.

With a path the ledger writes rows to a Parquet file chunk by chunk, so memory is bounded; without one they stay in
`rows`. `keep` writes the rows of the present chunk to a journal; it takes the bytes encoded for the hash, so it adds
little work.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mypy_extensions import mypyc_attr

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.absence import Absence
from netem.records.ledger_hash import LedgerHash
from netem.records.uninterrupted import uninterrupted
from netem.wire.instants import NEVER_NS

if TYPE_CHECKING:
    from netem.records.ledger_file import LedgerFile

Row = tuple[str, str, int, str, int, int, int, int, int, int, bytes, str, str]
COLUMNS = ("medium", "sender", "number", "receiver", "copy", "offered_ns", "on_air_ns", "end_ns", "delivered_ns",
           "size_bytes", "digest", "fate", "cause")
CHUNK_ROWS = 131_072        # some 40 MB
RECEIVER, DELIVERED_NS, FATE = COLUMNS.index("receiver"), COLUMNS.index("delivered_ns"), COLUMNS.index("fate")


class ConservationError(Exception):
    """The number of copies created differs from the number of copies closed."""


@dataclass(frozen=True)
class LedgerResult:
    """The hash and the totals of a finished ledger: copies by fate, in the order of `Fate`, and by medium and fate."""

    hash: str
    rows: int
    expected: int
    by_fate: Mapping[str, int]
    by_medium: Mapping[str, Mapping[str, int]]


@mypyc_attr(allow_interpreted_subclasses=True)
class Ledger:
    """Collects the rows; `path` is the Parquet file to write, `metadata` its entries beside the hash (scenario, seed).

    Instead of `path`, `file` takes the rows, as a `LedgerInMemory` does.

    `passed_ns()` returns the emulator's time: every arrival before it has happened. Each of `listeners` is called with
    rows as they are settled, several at a time.
    """

    def __init__(self, path: Path | None = None, *, file: LedgerFile | None = None,
                 metadata: Mapping[str, str] | None = None, chunk_rows: int = CHUNK_ROWS,
                 passed_ns: Callable[[], int] = lambda: NEVER_NS,
                 listeners: Sequence[Callable[[Sequence[Row]], None]] = ()) -> None:
        if chunk_rows < 1:
            raise ValueError(f"chunk_rows={chunk_rows}: a chunk holds at least 1 row")
        self._expected_of: Counter[str] = Counter()
        self._rows: list[Row] = []
        self._ended: Counter[tuple[str, str]] = Counter()       # (medium, fate) of the rows counted so far:
        self._counted = 0                                       # those written and the first `_counted` of `_rows`
        self._kept = 0                          # the first `_kept` of `_rows` are settled, hashed and in the journal
        self._passed_ns = passed_ns
        self._listeners = listeners
        self._absences: dict[str, list[Absence]] = {}           # by receiver
        self._hash = LedgerHash(COLUMNS)
        self._file = _open(path, metadata or {}) if path else file
        self._chunk_rows = chunk_rows
        self._flush_at = chunk_rows if self._file is not None else 1 << 62
        self._result: LedgerResult | None = None

    def expect(self, copies: int, medium: str = "") -> None:
        """Announce copies. If every call names its medium, a ConservationError names the media that differ."""
        self._expected_of[medium] += copies

    def close(self, frame: Frame, receiver: str, fate: Fate, *, copy: int = 0, delivered_ns: int = -1,
              cause: str = "") -> None:
        """Record the fate of one copy and its `cause`; `delivered_ns` is its arrival at the node, -1 without one."""
        rows = self._rows
        rows.append((frame.medium, frame.sender, frame.number, receiver, copy, frame.offered_ns, frame.on_air_ns,
                     frame.end_ns, delivered_ns, len(frame.data), frame.digest, fate._value_, cause))
        if len(rows) >= self._flush_at:
            self._flush()

    def receiver_away(self, receiver: str, absence: Absence) -> None:
        """Note an interval, which the emulator has not passed, in which `receiver` does not take what arrives.

        The intervals of one receiver do not overlap.
        """
        self._absences.setdefault(receiver, []).append(absence)

    @property
    def expected(self) -> int:
        """Copies announced so far."""
        return self._expected_of.total()

    @property
    def closed(self) -> Counter[Fate]:
        """Copies closed so far, by fate; one that has not arrived counts with the fate that its medium decided."""
        total: Counter[Fate] = Counter()
        for fate, copies in self._by_fate().items():
            total[Fate(fate)] = copies
        return total

    @property
    def rows(self) -> Sequence[Row]:
        """The rows that are not written yet; all rows if the ledger has no path."""
        return self._rows

    def keep(self) -> None:
        """Write the rows settled so far to the journal, so that they outlive this process.

        On OSError, as for a full disk, they stay in memory for the next call.
        """
        if self._file is None or self._kept == len(self._rows):
            return
        with uninterrupted():
            encoded = self._take_settled(self._passed_ns())
            if encoded:
                self._file.note(encoded)

    def finish(self, *, end_ns: int = NEVER_NS, complete: bool = True) -> LedgerResult:
        """Settle and write the remaining rows of a run that ended at `end_ns`, close the file and check conservation.

        The caller passes `complete=False` for an aborted run: copies on the air have no fate then, and nothing is
        checked. The file is whole in either case. Raises ConservationError; on OSError, as for a full disk, the journal
        with the rows kept so far remains.
        """
        if self._result is None:
            self._result = self._end(end_ns)
        if complete:
            self._check(self._result)
        return self._result

    def _end(self, end_ns: int) -> LedgerResult:
        with uninterrupted():               # otherwise a second call would hash the same rows again
            unkept = self._take_settled(end_ns, ended=True)
        by_medium: dict[str, dict[str, int]] = {}
        for (medium, fate), copies in sorted(self._counts().items(), key=lambda item: (item[0][0], _rank(item[0][1]))):
            by_medium.setdefault(medium, {})[fate] = copies
        by_fate = dict(sorted(self._by_fate().items(), key=lambda item: _rank(item[0])))
        if self._file is not None:
            self._write_settled()
            self._file.finish(unkept, hash=self._hash.hex(), rows=sum(by_fate.values()), expected=self.expected)
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
        self.keep()
        self._write_settled()
        self._flush_at = len(self._rows) + self._chunk_rows

    def _write_settled(self) -> None:
        """Move the settled rows from memory to the file."""
        assert self._file is not None
        with uninterrupted():
            self._counts()
            rows, self._rows = self._rows[:self._kept], self._rows[self._kept:]
            self._counted, self._kept = len(self._rows), 0
            if rows:
                self._file.write(rows)

    def _take_settled(self, passed_ns: int, *, ended: bool = False) -> bytes:
        """Settle and hash the rows up to the first that arrives at or after `passed_ns`; return them as MessagePack.

        With `ended` that row and later ones like it become UNFINISHED. Returns b"" if no row is settled.
        """
        rows: list[Any] = self._rows            # not Row: compiled code would unpack each
        absences, kept, settled = self._absences, self._kept, len(rows)
        for index in range(kept, settled):
            arrival_ns = rows[index][DELIVERED_NS]
            if arrival_ns >= passed_ns:
                if not ended:
                    settled = index
                    break
                self._correct(index, Fate.UNFINISHED, "under way")
            elif absences and arrival_ns >= 0:
                self._settle_absence(index, rows[index], arrival_ns)
        if settled == kept:
            return b""
        self._kept = settled
        rows = rows[kept:settled]
        for tell in self._listeners:
            tell(rows)
        return self._hash.add(rows)

    def _settle_absence(self, index: int, row: Any, arrival_ns: int) -> None:
        """Correct the fate of a copy that arrived while its receiver did not take what arrives."""
        for absence in self._absences.get(row[RECEIVER], ()):
            if absence.from_ns <= arrival_ns < absence.until_ns:
                if (fate := absence.fate(row[0], arrival_ns)) is not None:
                    self._correct(index, fate, absence.cause)
                return

    def _correct(self, index: int, fate: Fate, cause: str) -> None:
        """Replace the fate of a copy that does not arrive after all."""
        rows: list[Any] = self._rows
        row = rows[index]
        if index < self._counted:
            self._ended.subtract([(row[0], row[FATE])])
            self._ended.update([(row[0], fate.value)])
        rows[index] = (*row[:DELIVERED_NS], -1, *row[DELIVERED_NS + 1:FATE], fate.value, cause)

    def _counts(self) -> Counter[tuple[str, str]]:
        """Return copies closed so far by (medium, fate); rows counted by an earlier call are not read again."""
        self._ended.update((row[0], row[11]) for row in islice(self._rows, self._counted, None))
        self._counted = len(self._rows)
        return +self._ended

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

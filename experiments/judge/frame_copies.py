"""The frame copies of a run for computing figures: one NumPy array per column of the ledger, one row per copy.

Text columns are codes into a tuple of sorted names, so that codes compare as the names do. `link` has (medium, sender,
receiver) as its names. Links and fates are kept in memory, a few bytes per copy; any other column is read each time it
is requested, so that memory holds the columns of one figure only. `by_link` yields the rows link after link in portions
of bounded size, so that a figure over millions of copies needs little memory of its own.

Invariants:
- rows are in the order of the ledger, also in a selection by mask;
- every instant is an int64 in nanoseconds. Products of two instants do not fit: convert before multiplying.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from netem.core.fate import Fate
from netem.records.ledger import COLUMNS, Row

if TYPE_CHECKING:                       # the command `check` needs the kinds of guarantees and reads no ledger
    import pyarrow as pa

    from netem.records.ledger_in_memory import LedgerInMemory

    Read = Callable[[Sequence[str]], pa.Table]

Ints = NDArray[np.int64]
Codes = NDArray[np.unsignedinteger[Any]]
Mask = NDArray[np.bool_]

LINK = ("medium", "sender", "receiver")
DELIVERED = Fate.DELIVERED.value
PORTION = 1 << 17               # most rows in a portion of `by_link`, unless one link has more
LARGEST_TABLE = 1 << 22         # most combinations of names that a table numbers; more are sorted


class LedgerUnreadable(OSError):
    """A column of a ledger file cannot be read, though the file can be opened."""


@dataclass(frozen=True)
class Coded:
    """A column with few different values: row k has the value `names[codes[k]]`."""

    codes: Codes
    names: tuple[Any, ...]

    def among(self, *names: str) -> Mask:
        """Mask of the rows whose value is one of `names`."""
        wanted = np.array([name in names for name in self.names], dtype=np.bool_)
        return wanted[self.codes] if wanted.any() else np.zeros(self.codes.size, dtype=np.bool_)

    def values(self) -> list[Any]:
        return [self.names[code] for code in self.codes.tolist()]

    def used(self) -> list[Any]:
        """The names that occur in at least one row."""
        return [name for name, rows in zip(self.names, self.counts().tolist(), strict=True) if rows]

    def counts(self) -> Ints:
        """Number of rows with each name."""
        return np.bincount(self.codes, minlength=len(self.names))

    def __getitem__(self, rows: Any) -> Coded:
        return Coded(self.codes[rows], self.names)


class Portion(NamedTuple):
    """The rows of all copies on the links [first, end), by link, then in the order of the ledger."""

    first: int
    end: int
    rows: Ints


class FrameCopies:
    """`ints` and `coded` return a column by its name; `count` is the number of rows."""

    def __init__(self, count: int, ints: Callable[[str], Ints], coded: Callable[[str], Coded]) -> None:
        self._count = count
        self.ints = ints
        self.coded = coded

    @staticmethod
    def of_file(path: Path) -> FrameCopies:
        """The copies in a ledger file. Links are read at once, other columns when they are requested.

        Raises FileNotFoundError, or LedgerUnreadable, which a column requested later may raise as well.
        """
        import pyarrow as pa

        from netem.records.ledger_file import read_ledger

        def read(columns: Sequence[str]) -> pa.Table:
            try:
                return read_ledger(path, list(columns))
            except FileNotFoundError:
                raise
            except (pa.ArrowException, OSError) as error:
                raise LedgerUnreadable(f"{', '.join(columns)}: {error}") from error

        return _of_source(read)

    @staticmethod
    def of_table(table: pa.Table) -> FrameCopies:
        return _of_source(table.select)

    @staticmethod
    def of_memory(ledger: LedgerInMemory) -> FrameCopies:
        """The copies of a finished ledger in memory."""
        return FrameCopies.of_rows(ledger.rows) if ledger.few else FrameCopies.of_table(ledger.table())

    @staticmethod
    def of_rows(rows: Sequence[Row]) -> FrameCopies:
        """The copies in the rows of a `Ledger` in memory; a column is converted when it is requested."""
        def ints(name: str) -> Ints:
            place = COLUMNS.index(name)
            return np.array([row[place] for row in rows], dtype=np.int64)

        def coded(name: str) -> Coded:
            if name == "link":
                return _coded_values([(row[0], row[1], row[3]) for row in rows])
            place = COLUMNS.index(name)
            return _coded_values([row[place] for row in rows])

        return FrameCopies(len(rows), ints, coded)

    def __len__(self) -> int:
        return self._count

    @cached_property
    def link(self) -> Coded:
        return self.coded("link")

    @cached_property
    def fate(self) -> Coded:
        return self.coded("fate")

    @property
    def delivered(self) -> Mask:
        return self.fate.among(DELIVERED)

    def end_of(self, *, medium: str | None = None, sender: str | None = None, receiver: str | None = None) -> Mask:
        """Mask of the rows on links with these names."""
        wanted = (medium, sender, receiver)
        chosen = np.array([all(want is None or want == name for want, name in zip(wanted, link, strict=True))
                           for link in self.link.names], dtype=np.bool_)
        return chosen[self.link.codes] if chosen.size else np.zeros(self._count, dtype=np.bool_)

    def only(self, *, fate: str | None = None, **names: str) -> FrameCopies:
        """The copies with this fate and on links with these names: `only(fate="lost", receiver="r2")`."""
        mask = self.end_of(**names)
        return self.taken(mask if fate is None else mask & self.fate.among(fate))

    def taken(self, rows: Mask | NDArray[np.integer[Any]]) -> FrameCopies:
        """The selected rows: `rows` is a mask, or indices in the wanted order."""
        chosen = np.flatnonzero(rows) if rows.dtype == np.bool_ else rows

        def coded(name: str) -> Coded:
            whole = self.link if name == "link" else self.fate if name == "fate" else self.coded(name)
            return whole[chosen]

        return FrameCopies(chosen.size, lambda name: self.ints(name)[chosen], coded)

    def by_link(self) -> Iterator[Portion]:
        """Yield the rows of all links in portions of at most `PORTION` rows, or of one link."""
        ends = np.cumsum(self.link.counts())
        order = self._order
        first, start = 0, 0
        while first < ends.size:
            end = max(first + 1, int(np.searchsorted(ends, start + PORTION, side="right")))
            yield Portion(first, end, order[start:ends[end - 1]])
            first, start = end, int(ends[end - 1])

    @cached_property
    def _order(self) -> Ints:
        """Row indices sorted by link, then in the order of the ledger."""
        return np.argsort(self.link.codes, kind="stable")


def smallest(codes: NDArray[np.integer[Any]], names: int) -> Codes:
    """Convert codes to the smallest unsigned type for so many names: NumPy sorts up to 16 bits in linear time."""
    kind = np.uint8 if names <= 1 << 8 else np.uint16 if names <= 1 << 16 else np.uint32
    return codes.astype(kind)


def combined(columns: Sequence[Coded]) -> Coded:
    """Combine columns into one, whose values are the tuples of their values that occur, in the order of the names."""
    sizes = [max(1, len(column.names)) for column in columns]
    keys = np.zeros(columns[0].codes.size, dtype=np.int64)
    for column, size in zip(columns, sizes, strict=True):
        keys = keys * size + column.codes
    possible = int(np.prod(np.array(sizes, dtype=object)))
    if possible <= LARGEST_TABLE:
        there = np.zeros(possible, dtype=np.bool_)
        there[keys] = True
        found = np.flatnonzero(there)
        codes = (np.cumsum(there) - 1)[keys]
    else:
        assert possible < 1 << 63, f"{sizes}: too many combinations of names for an int64"
        found, codes = np.unique(keys, return_inverse=True)
    parts = []
    for size in reversed(sizes):
        found, part = np.divmod(found, size)
        parts.append(part.tolist())
    names = [tuple(column.names[k] for column, k in zip(columns, of, strict=True)) for of in zip(*reversed(parts),
                                                                                                 strict=True)]
    return Coded(smallest(codes, len(names)), tuple(names))


def _of_source(read: Read) -> FrameCopies:
    def ints(name: str) -> Ints:
        found: Ints = read([name]).column(0).to_numpy()
        return found

    table = read(LINK)
    link = combined([_coded(table.column(name)) for name in LINK])
    return FrameCopies(table.num_rows, ints, lambda name: link if name == "link" else _coded(read([name]).column(0)))


def _coded_values(values: Sequence[Any]) -> Coded:
    names = sorted(set(values))
    place = {name: code for code, name in enumerate(names)}
    return Coded(smallest(np.array([place[value] for value in values], dtype=np.int64), len(names)), tuple(names))


def _coded(column: pa.ChunkedArray) -> Coded:
    import pyarrow as pa

    if not pa.types.is_dictionary(column.type):
        column = column.dictionary_encode()
    chunks = column.unify_dictionaries().chunks
    told: list[str] = chunks[0].dictionary.to_pylist() if chunks else []
    names = sorted(set(told))
    place = {name: code for code, name in enumerate(names)}
    rank = smallest(np.array([place[name] for name in told], dtype=np.int64), len(names))
    codes = [rank[chunk.indices.to_numpy()] for chunk in chunks]
    return Coded(np.concatenate(codes) if codes else smallest(np.zeros(0, dtype=np.int64), 0), tuple(names))

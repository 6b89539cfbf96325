"""Decodes the signals of the frames on a bus by a DBC file, as tables of samples: one for each message, BUS_MESSAGE.

    frame --identifier--> message --length, multiplexer--> physical values, at the instant at which receivers have it

A multiplexed message has a table of its own for each set of signals that come together, BUS_MESSAGE_m1 for those of the
multiplexer value 1, so that every sample is whole. Items of a value table are recorded as their numbers.

What cannot be decoded is counted: identifiers that the file does not have, frames of another length than the message's,
and values that it does not define, as those of an unknown multiplexer. Remote frames and error frames have no signals.

Not decoded: messages whose identifier stands in the file twice, and text that is not DBC, which `read_dbc` leaves out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from netem.core.frame import Frame
from netem.core.nearest import nearest
from netem.media.can.dbc_file import cantools_error, read_dbc
from netem.media.can.frame import fd_length, unpack

if TYPE_CHECKING:
    from netem.media.can.dbc_file import Message

MOST_SIGNALS: Final = 256           # of one bus
UNKNOWN, WRONG_LENGTH, UNDECODABLE = "dbc_unknown_identifiers", "dbc_wrong_lengths", "dbc_undecodable"

Sample = Callable[[str, int, list[float]], None]


@dataclass(frozen=True)
class Table:
    """Signals that are sampled together: (name, unit), unit "1" for a pure number."""

    name: str
    signals: tuple[tuple[str, str], ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(name for name, _ in self.signals)


class DbcSignals:
    """A tap on the bus `bus`; raises ValueError for patterns that match no signal, or too many."""

    def __init__(self, bus: str, file: Path, patterns: Sequence[str]) -> None:
        self.counters: Counter[str] = Counter({UNKNOWN: 0, WRONG_LENGTH: 0, UNDECODABLE: 0})
        self.sample: Sample = lambda table, time_ns, values: None
        self._tables: dict[tuple[int, bool], tuple[Message, list[Table]]] = {}
        database = read_dbc(file).database
        twice = Counter((message.frame_id, message.is_extended_frame) for message in database.messages)
        known: list[str] = []
        for message in database.messages:
            key = message.frame_id, bool(message.is_extended_frame)
            if twice[key] > 1:
                continue
            names = [f"{message.name}.{signal.name}" for signal in message.signals]
            known += names
            wanted = {name.partition(".")[2] for name in names
                      if any(fnmatchcase(name, pattern) for pattern in patterns)}
            self._tables[key] = message, _tables(bus, message, wanted)
        for pattern in patterns:
            if not any(fnmatchcase(name, pattern) for name in known):
                near = nearest(pattern, known)
                raise ValueError(f"dbc_signals={pattern}: no such MESSAGE.SIGNAL in {file.name}"
                                 + (f"; the nearest is {near}" if near else ""))
        number = sum(len(table.signals) for table in self.tables)
        if number > MOST_SIGNALS:
            raise ValueError(f"dbc_signals: {number} signals of {file.name}: at most {MOST_SIGNALS} of a bus are "
                             "recorded; name those that you need")

    @property
    def tables(self) -> list[Table]:
        return [table for _, tables in self._tables.values() for table in tables]

    def frame(self, frame: Frame, seen_ns: int) -> None:
        """Decode the signals of a frame and pass them to `sample`, at the instant at which receivers have it."""
        seen = unpack(frame.data)
        if seen.remote or seen.error:
            return
        found = self._tables.get((seen.can_id, seen.extended))
        if found is None:
            self.counters[UNKNOWN] += 1
            return
        message, tables = found
        length = message.length
        if len(seen.data) != (fd_length(length) if seen.fd and length <= 64 else length):
            self.counters[WRONG_LENGTH] += 1
            return
        if not tables:
            return
        try:
            values: dict[str, Any] = message.decode_simple(seen.data[:length], decode_choices=False) \
                if not message.is_multiplexed() else _plain(message.decode(seen.data[:length], decode_choices=False))
        except (cantools_error(), ValueError, LookupError, ArithmeticError):
            self.counters[UNDECODABLE] += 1
            return
        for table in tables:
            if all(name in values for name in table.names):
                self.sample(table.name, seen_ns, [float(values[name]) for name in table.names])

    def error_frame(self, medium: str, time_ns: int) -> None:
        """Do nothing: an error frame has no signals."""


def _plain(values: Any) -> dict[str, Any]:
    found: dict[str, Any] = values
    return found


def _tables(bus: str, message: Message, wanted: set[str]) -> list[Table]:
    """Return the tables of a message, without the signals that are not wanted."""
    groups: dict[tuple[str, ...], list[tuple[str, str]]] = {}
    parents = {signal.name: signal for signal in message.signals}
    for signal in message.signals:
        if signal.name in wanted:
            groups.setdefault(_condition(signal, parents), []).append((signal.name, signal.unit or "1"))
    return [Table("_".join((bus, message.name, *condition)), tuple(signals)) for condition, signals in groups.items()]


def _condition(signal: Any, parents: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the multiplexer values at which the signal is there, as m1 or m1_2; () if it always is."""
    if not signal.multiplexer_ids:
        return ()
    parent = parents.get(signal.multiplexer_signal)
    ids = "m" + "_".join(map(str, sorted(signal.multiplexer_ids)))
    return (*(_condition(parent, parents) if parent is not None else ()), ids)

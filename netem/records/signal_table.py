"""Reads a signals file in one pass: a table for each node, the events, the metadata and the scenario.

A run that was killed leaves only the journal of the signals; it is read up to its last whole piece, and `whole` is
False.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import numpy as np
from numpy.typing import NDArray

from netem.records.events import Event, in_order
from netem.wire.level import Level

if TYPE_CHECKING:
    from mcap.records import Channel, Message, Schema


@dataclass(frozen=True)
class SignalTable:
    """Samples of one node: `values[k, column]` at `time_ns[k]`, columns as in `names`; nan where not finite."""

    node: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    time_ns: NDArray[np.int64]
    values: NDArray[np.float64]

    def column(self, name: str) -> NDArray[np.float64]:
        return self.values[:, self.names.index(name)]


@dataclass
class Recording:
    signals: dict[str, SignalTable] = field(default_factory=dict)
    events: list[Event] = field(default_factory=list)
    metadata: dict[str, str] = field(default_factory=dict)
    scenario: bytes = b""
    whole: bool = False


class _Properties(msgspec.Struct):
    properties: dict[str, dict[str, object]]


class _Log(msgspec.Struct):
    name: str
    kind: str
    detail: str
    level: int
    wall_clock: bool = False


def read_signals(path: Path) -> dict[str, SignalTable]:
    return read_recording(path).signals


def read_recording(path: Path) -> Recording:
    from mcap.exceptions import McapError  # late: guarantees name tables of signals, and a check reads none
    from mcap.records import Attachment, Channel, Footer, Message, Metadata, Schema
    from mcap.stream_reader import StreamReader

    from netem.records.signals import EVENTS_TOPIC, SCENARIO, journal_of

    recording = Recording()
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    messages: dict[int, list[Message]] = {}
    if not path.exists() and journal_of(path).exists():
        return _from_journal(path)
    with path.open("rb") as stream:
        try:
            for record in StreamReader(stream).records:
                if isinstance(record, Message):
                    messages[record.channel_id].append(record)
                elif isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                    messages.setdefault(record.id, [])
                elif isinstance(record, Metadata):
                    recording.metadata.update(record.metadata)
                elif isinstance(record, Attachment) and record.name == SCENARIO:
                    recording.scenario = record.data
                elif isinstance(record, Footer):
                    recording.whole = True
        except (McapError, struct.error):
            recording.whole = False
    for number, channel in channels.items():
        if channel.topic == EVENTS_TOPIC:
            recording.events = [_event(message) for message in messages[number]]
        else:
            node = channel.metadata["node"]
            recording.signals[node] = _table(node, schemas[channel.schema_id], messages[number])
    return recording


def _from_journal(path: Path) -> Recording:
    from netem.records.journal import pieces_of
    from netem.records.signals import journal_of

    recording = Recording()
    declared: dict[str, list[tuple[str, str]]] = {}
    samples: dict[str, list[tuple[int, list[float]]]] = {}
    for piece in pieces_of(journal_of(path)):
        sort, *content = msgspec.msgpack.decode(piece)
        if sort == "signals":
            declared[content[0]] = content[1]
            samples[content[0]] = []
        elif sort == "samples":
            samples[content[0]] += content[1]
        else:
            recording.events += [Event(time_ns, node, kind, detail, Level(level), wall_clock)
                                 for time_ns, node, kind, detail, level, wall_clock in content[0]]
    for node, signals in declared.items():
        names, units = ([pair[k] for pair in signals] for k in (0, 1))
        values = np.array([row for _, row in samples[node]], dtype=np.float64).reshape(len(samples[node]), len(names))
        values[~np.isfinite(values)] = np.nan
        recording.signals[node] = SignalTable(node, tuple(names), tuple(units),
                                              np.array([time_ns for time_ns, _ in samples[node]], dtype=np.int64),
                                              values)
    recording.events = in_order(recording.events)
    return recording


def _table(node: str, schema: Schema, messages: list[Message]) -> SignalTable:
    properties = msgspec.json.decode(schema.data, type=_Properties).properties
    names = tuple(properties)
    decode = msgspec.json.Decoder(dict[str, float]).decode
    nan = float("nan")
    rows = [[sample.get(name, nan) for name in names] for sample in (decode(message.data) for message in messages)]
    return SignalTable(node, names, tuple(str(properties[name].get("description", "1")) for name in names),
                       np.array([message.log_time for message in messages], dtype=np.int64),
                       np.array(rows, dtype=np.float64).reshape(len(rows), len(names)))


def _event(message: Message) -> Event:
    log = msgspec.json.decode(message.data, type=_Log)
    return Event(message.log_time, log.name, log.kind, log.detail, Level(log.level), log.wall_clock)

"""Signals and events of a run as an MCAP file that Foxglove opens and plots: the recorder, and the reader.

One topic per node, `/<node>/signals`, with one number per signal and its unit in the schema's `description`; `/events`
holds `foxglove.Log` messages with `kind` and `detail` beside Foxglove's own fields. `log_time = publish_time` =
simulated time [ns] from the start of the run; `sequence` is 0, as there is no publisher whose messages could be missed.

JSON has no number for nan and infinity: such a value is left out of its message and is read as nan.

The file gets its name when it is whole. Until then samples and events are also in a journal, `signals.rows.part`, as
MessagePack, since encoding them as JSON takes longer.

The file has no message index, which would take 16 bytes a sample beside the 6 of the sample itself, and no chunk index,
since Foxglove refuses a chunk index without a message index; without both Foxglove reads the file as a whole (decision
0015).
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Footer, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer

from netem.records import Feed, Place, Recorder, Sample
from netem.records.events import Event, hash_of_events, in_order
from netem.records.journal import GrowingFile, Journal, journal_of, pieces_of
from netem.records.part_file import part_of, publish
from netem.records.sample_buffer import SampleBuffer, Topic
from netem.records.signal_table import SignalTable
from netem.records.uninterrupted import uninterrupted
from netem.wire.level import Level

BUFFERED_SAMPLES = 50_000
CHUNK_BYTES = 4 << 20       # before compression; larger ones compress no better
EVENTS_TOPIC = "/events"
FILE: Final = "signals.mcap"
SCENARIO = "scenario.json"
LOG_SCHEMA = {
    "title": "foxglove.Log",
    "type": "object",
    "properties": {
        "timestamp": {"type": "object", "title": "time", "description": "simulated time",
                      "properties": {"sec": {"type": "integer", "minimum": 0},
                                     "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999}}},
        "level": {"type": "integer", "minimum": 0, "maximum": 5},
        "message": {"type": "string"},
        "name": {"type": "string", "description": "node, empty for the emulator"},
        "file": {"type": "string"},
        "line": {"type": "integer", "minimum": 0},
        "kind": {"type": "string"},
        "detail": {"type": "string"},
        "wall_clock": {"type": "boolean", "description": "about the wall clock, so not the same in every run"},
    },
    "required": ["timestamp", "level", "message", "name", "kind", "detail"],
}


class SignalFile:
    """Collects samples and events and writes them in order of time, the last of them in `finish`."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._stream = GrowingFile(part_of(path))
        self._journal = Journal(journal_of(path))
        self._encode = msgspec.msgpack.Encoder().encode
        stream: Any = self._stream
        self._writer = Writer(stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD,
                              index_types=IndexType.ATTACHMENT | IndexType.METADATA)
        self._writer.start(profile="", library="marconet")
        self._samples = SampleBuffer(BUFFERED_SAMPLES, self._make_room)
        self._topics = self._samples.topics
        self._events: list[Event] = []
        self._events_kept = 0
        self._closed = False

    def declare(self, node: str, signals: Sequence[tuple[str, str]]) -> None:
        """Announce all signals of a node as (name, unit) pairs; the unit of a pure number is "1".

        Raises ValueError if a name occurs twice or the node has declared its signals already.
        """
        names = tuple(name for name, _ in signals)
        if node in self._topics:
            raise ValueError(f"node {node!r} declared its signals twice: declare all of them at once")
        if len(set(names)) != len(names):
            raise ValueError(f"node {node!r}: signals {list(names)}: each name once")
        schema = {"title": f"{node}.signals", "type": "object",
                  "properties": {name: {"type": "number", "description": unit} for name, unit in signals}}
        self._topics[node] = Topic(self._channel(f"/{node}/signals", f"{node}.signals", schema, {"node": node}), names)
        self._journal.add(self._encode(("signals", node, list(signals))))

    def append(self, node: str, time_ns: int, values: Sequence[float]) -> None:
        """See `SampleBuffer.append`."""
        self._samples.append(node, time_ns, values)

    def sampler(self) -> Sample:
        """Return `append` as a function without a frame of Python."""
        return self._samples.append

    def _make_room(self) -> None:
        self.keep()
        self._write_samples()

    def event(self, event: Event) -> None:
        self._events.append(event)

    def keep(self) -> None:
        """Write the samples and events so far to the journal, so that they outlive this process.

        On OSError, as for a full disk, they stay in memory for the next call.
        """
        with uninterrupted():
            self._note(self._unkept())
            for topic in self._topics.values():
                topic.kept = len(topic.samples)
            self._events_kept = len(self._events)
            self._journal.commit()

    def _note(self, pieces: Iterable[tuple[Any, ...]]) -> None:
        """Add pieces to the journal; they stay in memory until its `commit`."""
        for piece in pieces:
            self._journal.add(self._encode(piece))

    def _unkept(self) -> list[tuple[Any, ...]]:
        """Return the samples and events that are not in the journal yet, as its pieces."""
        pieces: list[tuple[Any, ...]] = [("samples", node, topic.samples[topic.kept:])
                                         for node, topic in self._topics.items() if topic.kept < len(topic.samples)]
        if self._events_kept < len(self._events):
            pieces.append(("events", self._events[self._events_kept:]))
        return pieces

    @property
    def events(self) -> Sequence[Event]:
        return in_order(self._events)

    @property
    def events_hash(self) -> str:
        return hash_of_events(self._events)

    def finish(self, metadata: Mapping[str, str], scenario: bytes = b"") -> None:
        """Write the remaining samples, the events, the metadata record `marconet` and the resolved scenario (JSON).

        On OSError, as for a full disk, the file is removed; the journal stays, and the samples and events that are not
        in it yet are added to it if there is room now.
        """
        if self._closed:
            return
        self._closed = True
        unkept = self._unkept()
        try:
            self._write_samples()
            self._write_events()
            self._writer.add_metadata("marconet", dict(metadata) | {"events_hash": self.events_hash})
            if scenario:
                self._writer.add_attachment(0, 0, SCENARIO, "application/json", scenario)
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._stream.commit()
        except OSError:
            part_of(self._path).unlink()
            with suppress(OSError):
                self._note(unkept)
                self._journal.commit()
            raise
        finally:
            self._stream.close()
            self._journal.close()
        publish(self._path)
        journal_of(self._path).unlink()

    def _channel(self, topic: str, name: str, schema: Mapping[str, object], metadata: dict[str, str]) -> int:
        schema_id = self._writer.register_schema(name, "jsonschema", msgspec.json.encode(schema))
        return int(self._writer.register_channel(topic, "json", schema_id, metadata))

    def _write_samples(self) -> None:
        with uninterrupted():
            self._encode_samples()
            self._stream.commit()

    def _encode_samples(self) -> None:
        encode = msgspec.json.Encoder().encode
        add = self._writer.add_message
        waiting = [(time_ns, topic.channel, topic, values)
                   for topic in self._topics.values() for time_ns, values in topic.samples]
        waiting.sort(key=lambda item: item[:2])
        for time_ns, channel, topic, values in waiting:
            data = encode(dict(zip(topic.names, values, strict=True)))
            if b"null" in data:
                data = encode({name: value for name, value in zip(topic.names, values, strict=True)
                               if abs(value) < float("inf")})
            add(channel, time_ns, data, time_ns)
        self._samples.clear()

    def _write_events(self) -> None:
        if not self._events:
            return
        channel = self._channel(EVENTS_TOPIC, "foxglove.Log", LOG_SCHEMA, {})
        for event in self.events:
            message = {
                "timestamp": {"sec": event.time_ns // 10**9, "nsec": event.time_ns % 10**9}, "level": int(event.level),
                "message": f"{event.kind}: {event.detail}" if event.detail else event.kind, "name": event.node,
                "file": "", "line": 0, "kind": event.kind, "detail": event.detail, "wall_clock": event.wall_clock}
            self._writer.add_message(channel, event.time_ns, msgspec.json.encode(message), event.time_ns)


@dataclass
class Recording:
    """The content of a signals file; `whole` is False if the run was killed before it closed the file."""

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
    """Read the file at `path`, or of a run that was killed its journal up to the last whole piece."""
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


class SignalRecorder(Recorder):
    """Writes the signals and events of the run, with the scenario attached."""

    FILES = (FILE,)

    def __init__(self, settings: Any, place: Place) -> None:
        super().__init__(settings, place)
        self._file = SignalFile(place.folder / FILE)

    def record(self, run: Feed) -> None:
        run.declared.append(self._file.declare)
        run.samples.append(self._file.sampler())
        run.events.append(self._file.event)

    def keep(self) -> None:
        self._file.keep()

    def finish(self) -> None:
        self._file.finish(self.place.metadata, self.place.scenario)

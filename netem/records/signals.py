"""Signals and events of a run as an MCAP file that Foxglove opens and plots.

One topic per node, `/<node>/signals`, with one number per signal and its unit in the schema's `description`; `/events`
holds `foxglove.Log` messages with `kind` and `detail` beside Foxglove's own fields. `log_time = publish_time` =
simulated time [ns] from the start of the run; `sequence` counts the messages of a topic from 0.

JSON has no number for nan and infinity: such a value is left out of its message and reads back as nan.

Not modelled: integers, text and vectors as signals; a vector is one signal per component.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
from mcap.writer import CompressionType, Writer

from netem.records.events import Event, Level, hash_of_events, in_order

BUFFERED_SAMPLES = 50_000
EVENTS_TOPIC = "/events"
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


@dataclass
class _Topic:
    channel: int
    names: tuple[str, ...]
    samples: list[tuple[int, tuple[float, ...]]] = field(default_factory=list)
    written: int = 0


class SignalRecorder:
    """Collects samples and events; writes them in time order, at the latest when `finish` is called."""

    def __init__(self, path: Path) -> None:
        self._stream = path.open("wb")
        self._writer = Writer(self._stream, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library="marconet")
        self._topics: dict[str, _Topic] = {}
        self._events: list[Event] = []
        self._buffered = 0
        self._closed = False

    def declare(self, node: str, signals: Sequence[tuple[str, str]]) -> None:
        """Announce a node's signals as (name, unit) pairs; unit "1" for a pure number."""
        names = tuple(name for name, _ in signals)
        if node in self._topics:
            raise ValueError(f"node {node!r} declared its signals twice: declare all of them at once")
        if len(set(names)) != len(names):
            raise ValueError(f"node {node!r}: signals {list(names)}: each name once")
        schema = {"title": f"{node}.signals", "type": "object",
                  "properties": {name: {"type": "number", "description": unit} for name, unit in signals}}
        self._topics[node] = _Topic(self._channel(f"/{node}/signals", f"{node}.signals", schema, {"node": node}), names)

    def append(self, node: str, time_ns: int, values: Sequence[float]) -> None:
        """One sample of every signal of `node`, in the order declared; times of one node never decrease."""
        topic = self._topics[node]
        if len(values) != len(topic.names):
            raise ValueError(f"node {node!r} at {time_ns} ns: {len(values)} values for the {len(topic.names)} signals "
                             f"{list(topic.names)}")
        topic.samples.append((time_ns, tuple(values)))
        self._buffered += 1
        if self._buffered >= BUFFERED_SAMPLES:
            self._write_samples()

    def event(self, time_ns: int, node: str, kind: str, detail: str, level: Level = Level.INFO,
              *, wall_clock: bool = False) -> None:
        self._events.append(Event(time_ns, node, kind, detail, level, wall_clock))

    @property
    def events(self) -> Sequence[Event]:
        return in_order(self._events)

    @property
    def events_hash(self) -> str:
        return hash_of_events(self._events)

    def finish(self, metadata: Mapping[str, str], scenario: bytes = b"") -> None:
        """Write what is left, the metadata record `marconet` and the resolved scenario (JSON), and close the file."""
        if self._closed:
            return
        self._closed = True
        self._write_samples()
        self._write_events()
        self._writer.add_metadata("marconet", dict(metadata) | {"events_hash": self.events_hash})
        if scenario:
            self._writer.add_attachment(0, 0, SCENARIO, "application/json", scenario)
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._stream.close()

    def _channel(self, topic: str, name: str, schema: Mapping[str, object], metadata: dict[str, str]) -> int:
        schema_id = self._writer.register_schema(name, "jsonschema", msgspec.json.encode(schema))
        return int(self._writer.register_channel(topic, "json", schema_id, metadata))

    def _write_samples(self) -> None:
        encode = msgspec.json.Encoder().encode
        add = self._writer.add_message
        waiting = [(sample[0], topic.channel, topic.written + k, topic, sample[1])
                   for topic in self._topics.values() for k, sample in enumerate(topic.samples)]
        waiting.sort(key=lambda item: item[:3])
        for time_ns, channel, sequence, topic, values in waiting:
            data = encode(dict(zip(topic.names, values, strict=True)))
            if b"null" in data:
                data = encode({name: value for name, value in zip(topic.names, values, strict=True)
                               if abs(value) < float("inf")})
            add(channel, time_ns, data, time_ns, sequence)
        for topic in self._topics.values():
            topic.written += len(topic.samples)
            topic.samples.clear()
        self._buffered = 0

    def _write_events(self) -> None:
        if not self._events:
            return
        channel = self._channel(EVENTS_TOPIC, "foxglove.Log", LOG_SCHEMA, {})
        for sequence, event in enumerate(self.events):
            message = {
                "timestamp": {"sec": event.time_ns // 10**9, "nsec": event.time_ns % 10**9}, "level": int(event.level),
                "message": f"{event.kind}: {event.detail}" if event.detail else event.kind, "name": event.node,
                "file": "", "line": 0, "kind": event.kind, "detail": event.detail, "wall_clock": event.wall_clock}
            self._writer.add_message(channel, event.time_ns, msgspec.json.encode(message), event.time_ns, sequence)

"""The ledger's events as Parquet, `ledger_events.parquet`: what happened that is no frame copy, with time and cause.

Rows stand in the order that is hashed: by (time, node), events of one node at one instant as they were told. While the
run goes on they are in a stream, `ledger_events.arrows.part`, in the order in which they were told.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from netem.records.batch_stream import BatchStream, batches_of
from netem.records.events import Event, Level, in_order
from netem.records.part_file import part_of, publish

NAME = pa.dictionary(pa.int32(), pa.string())
SCHEMA = pa.schema([("time_ns", pa.int64()), ("node", NAME), ("kind", NAME), ("detail", pa.string()), ("level", NAME),
                    ("wall_clock", pa.bool_())])
Row = tuple[int, str, str, str, str, bool]


def stream_of(path: Path) -> Path:
    """The stream of the events that will be at `path`, as long as the run goes on."""
    return part_of(path.with_suffix(".arrows"))


class EventStream:
    """Events as they are told, for the file that `write_events` leaves at `path`."""

    def __init__(self, path: Path) -> None:
        self._stream = BatchStream(stream_of(path), SCHEMA)
        self._kept = 0

    def keep(self, told: list[Event]) -> None:
        """Write what was told since the last call; `told` holds all events, in the order in which they were told."""
        if len(told) > self._kept:
            self._stream.add([_row(event) for event in told[self._kept:]])
            self._kept = len(told)
            self._stream.commit()

    def close(self) -> None:
        self._stream.close()


def write_events(path: Path, events: Iterable[Event]) -> None:
    """Write the file, in the order that is hashed, and remove its stream. OSError leaves the stream."""
    part = part_of(path)
    rows = [_row(event) for event in in_order(events)]
    columns = zip(*rows, strict=True) if rows else [()] * len(SCHEMA)
    arrays = [pa.array(values, field.type) for field, values in zip(SCHEMA, columns, strict=True)]
    try:
        pq.write_table(pa.Table.from_arrays(arrays, schema=SCHEMA), part, compression="zstd")
        publish(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise
    stream_of(path).unlink(missing_ok=True)


def read_event_stream(path: Path) -> list[Event]:
    """The events that a run which was killed had told; none if there is no stream."""
    if not stream_of(path).exists():
        return []
    rows = [row for batch in batches_of(stream_of(path)) for row in batch.to_pylist()]
    return [Event(row["time_ns"], row["node"], row["kind"], row["detail"], Level[row["level"]], row["wall_clock"])
            for row in rows]


def _row(event: Event) -> Row:
    return event.time_ns, event.node, event.kind, event.detail, event.level.name, event.wall_clock

"""The events of a run as a Parquet file, `ledger_events.parquet`.

Rows are in the order that is hashed: by (time, node); events of one node at one instant keep their order.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

from netem.records import Feed, Place, Recorder
from netem.records.columns import NAME, column_of
from netem.records.events import Event, in_order
from netem.records.part_file import part_of, publish

FILE: Final = "ledger_events.parquet"
SCHEMA = pa.schema([("time_ns", pa.int64()), ("node", NAME), ("kind", NAME), ("detail", pa.string()), ("level", NAME),
                    ("wall_clock", pa.bool_())])


def write_events(path: Path, events: Iterable[Event]) -> None:
    """Write `events` in the order that is hashed. On OSError no file is left."""
    part = part_of(path)
    rows = [_row(event) for event in in_order(events)]
    columns = zip(*rows, strict=True) if rows else [()] * len(SCHEMA)
    arrays = [column_of(field.type, values) for field, values in zip(SCHEMA, columns, strict=True)]
    try:
        pq.write_table(pa.Table.from_arrays(arrays, schema=SCHEMA), part, compression="zstd")
        publish(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def _row(event: Event) -> tuple[int, str, str, str, str, bool]:
    return event.time_ns, event.node, event.kind, event.detail, event.level.name, event.wall_clock


class EventRecorder(Recorder):
    """Writes `ledger_events.parquet` at the end of the run."""

    FILES = (FILE,)

    def __init__(self, settings: Any, place: Place) -> None:
        super().__init__(settings, place)
        self._events: list[Event] = []

    def record(self, run: Feed) -> None:
        run.events.append(self._events.append)

    def finish(self) -> None:
        write_events(self.place.folder / FILE, self._events)

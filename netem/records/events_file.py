"""The ledger's events as Parquet, `ledger_events.parquet`: what happened that is no frame copy, with time and cause.

Rows stand in the order that is hashed: by (time, node), events of one node at one instant as they were told.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import polars

from netem.records.events import Event, in_order

SCHEMA = {"time_ns": polars.Int64, "node": polars.Categorical, "kind": polars.Categorical, "detail": polars.String,
          "level": polars.Categorical, "wall_clock": polars.Boolean}


def write_events(path: Path, events: Iterable[Event]) -> None:
    rows = [(event.time_ns, event.node, event.kind, event.detail, event.level.name, event.wall_clock)
            for event in in_order(events)]
    polars.DataFrame(rows, schema=SCHEMA, orient="row").write_parquet(path)

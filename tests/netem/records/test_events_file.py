from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq

from netem.records.events import Event
from netem.records.events_file import write_events
from netem.wire.level import Level


def test_events_read_back_in_the_order_that_is_hashed(tmp_path: Path) -> None:
    told = [Event(9, "b", "late", "by 2 ms", wall_clock=True), Event(5, "b", "first", ""),
            Event(5, "a", "assumption violated", "radius", Level.WARNING), Event(5, "b", "second", "")]

    write_events(tmp_path / "events.parquet", told)

    table = pq.read_table(tmp_path / "events.parquet")
    assert list(zip(*(column.to_pylist() for column in table.columns), strict=True)) == [
        (5, "a", "assumption violated", "radius", "WARNING", False), (5, "b", "first", "", "INFO", False),
        (5, "b", "second", "", "INFO", False), (9, "b", "late", "by 2 ms", "INFO", True)]


def test_a_run_without_events_leaves_an_empty_table(tmp_path: Path) -> None:
    write_events(tmp_path / "events.parquet", [])

    assert pq.read_table(tmp_path / "events.parquet").shape == (0, 6)

"""Columns of the ledger as arrays, against the rows that they were made from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.judge import frame_copies
from experiments.judge.frame_copies import FrameCopies, LedgerUnreadable
from experiments.show.report.build import write_report
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.ledger import COLUMNS, Ledger, Row
from tests.examples import examples

NODES = st.sampled_from(["a", "b", "r10", "r2"])
COPIES = st.lists(st.tuples(st.sampled_from(["radio", "can"]), NODES, NODES, st.integers(0, 9),
                            st.sampled_from(list(Fate)), st.sampled_from(["", "impairments[0] delay"])), max_size=60)
Closed = list[tuple[str, str, str, int, Fate, str]]


def closed(copies: Closed, path: Path | None = None) -> Ledger:
    ledger = Ledger(path, chunk_rows=7)
    for medium, sender, receiver, number, fate, cause in copies:
        ledger.expect(1, medium)
        ledger.close(Frame(medium, sender, number, number * 1000, b"x" * number, number * 1000 + 1, number * 1000 + 9),
                     receiver, fate, delivered_ns=number * 1000 + 10 if fate is Fate.DELIVERED else -1, cause=cause)
    ledger.finish()
    return ledger


def column(rows: list[Row], name: str) -> list[object]:
    return [row[COLUMNS.index(name)] for row in rows]


def links(rows: list[Row]) -> list[tuple[str, str, str]]:
    return [(row[0], row[1], row[3]) for row in rows]


@given(COPIES)
@settings(max_examples=examples(100), deadline=None)
def test_columns_hold_what_the_rows_do(copies: Closed) -> None:
    rows = list(closed(copies).rows)

    found = FrameCopies.of_rows(rows)

    assert len(found) == len(rows)
    for name in ("number", "copy", "offered_ns", "on_air_ns", "end_ns", "delivered_ns", "size_bytes"):
        assert found.ints(name).tolist() == column(rows, name)
    for name in ("fate", "cause"):
        assert found.coded(name).values() == column(rows, name)
    assert found.link.values() == links(rows)
    assert list(found.link.names) == sorted(set(links(rows)))


def test_a_file_of_several_chunks_gives_the_same_columns(tmp_path: Path) -> None:
    copies = [("radio", f"r{k % 5}", f"r{k % 3}", k, list(Fate)[k % 9], f"cause {k % 4}") for k in range(60)]
    closed(copies, tmp_path / "ledger.parquet")

    found, expected = FrameCopies.of_file(tmp_path / "ledger.parquet"), FrameCopies.of_rows(closed(copies).rows)

    assert found.link.values() == expected.link.values()
    assert found.fate.values() == expected.fate.values()
    assert found.coded("cause").values() == expected.coded("cause").values()
    assert found.ints("delivered_ns").tolist() == expected.ints("delivered_ns").tolist()


@given(COPIES, st.sampled_from(list(Fate)), NODES)
@settings(max_examples=examples(100), deadline=None)
def test_a_selection_keeps_the_order_and_can_be_narrowed_again(copies: Closed, fate: Fate, node: str) -> None:
    rows = list(closed(copies).rows)

    found = FrameCopies.of_rows(rows).only(fate=fate.value).only(receiver=node)

    wanted = [row for row in rows if row[11] == fate.value and row[3] == node]
    assert found.ints("number").tolist() == column(wanted, "number")
    assert found.link.values() == links(wanted)


@given(COPIES, st.integers(1, 20))
@settings(max_examples=examples(100), deadline=None)
def test_portions_hold_every_row_once_and_every_link_whole(copies: Closed, most: int) -> None:
    found = FrameCopies.of_rows(closed(copies).rows)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(frame_copies, "PORTION", most)

        portions = list(found.by_link())

    rows = [row for portion in portions for row in portion.rows.tolist()]
    assert sorted(rows) == list(range(len(found)))
    assert rows == sorted(rows, key=lambda row: (int(found.link.codes[row]), row))
    for first, end, own in portions:
        assert set(found.link.codes[own].tolist()) == set(range(first, end))
        assert own.size <= most or end == first + 1


def test_names_that_are_too_many_for_a_table_are_numbered_by_sorting(monkeypatch: pytest.MonkeyPatch) -> None:
    copies: Closed = [("radio", f"r{k % 50}", f"r{k % 7}", k, Fate.DELIVERED, "") for k in range(300)]
    by_table = FrameCopies.of_rows(closed(copies).rows).link
    monkeypatch.setattr(frame_copies, "LARGEST_TABLE", 1)

    by_sorting = FrameCopies.of_rows(closed(copies).rows).link

    assert by_sorting.names == by_table.names
    assert np.array_equal(by_sorting.codes, by_table.codes)


def test_a_ledger_with_a_damaged_column_is_named_and_the_report_does_without_it(tmp_path: Path) -> None:
    path = tmp_path / "ledger.parquet"
    closed([("radio", "a", "b", k, Fate.DELIVERED, "") for k in range(5000)], path)
    damage(path, "offered_ns")

    found = FrameCopies.of_file(path)

    assert len(found) == 5000
    with pytest.raises(LedgerUnreadable, match="offered_ns"):
        found.ints("offered_ns")
    assert "ledger.parquet: unreadable: offered_ns" in write_report(tmp_path).read_text(encoding="utf-8")


def damage(path: Path, name: str) -> None:
    """Overwrite the pages of one column."""
    import pyarrow.parquet as pq

    group = pq.ParquetFile(path).metadata.row_group(0)
    chunk = next(group.column(k) for k in range(group.num_columns) if group.column(k).path_in_schema == name)
    start = chunk.dictionary_page_offset or chunk.data_page_offset
    data = bytearray(path.read_bytes())
    data[start:start + chunk.total_compressed_size] = b"\xff" * chunk.total_compressed_size
    path.write_bytes(data)

"""The ledger counts, hashes and writes; its oracles are a second encoder (struct, by hand) and Parquet's own reader."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Sequence
from hashlib import blake2b
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.absence import Absence
from netem.records.ledger import COLUMNS, ConservationError, Ledger
from netem.records.ledger_file import SCHEMA, hash_of, noted_batches, read_ledger, read_metadata
from netem.records.ledger_hash import LedgerHash, array_header_bytes
from netem.wire.instants import NEVER_NS
from tests.examples import examples

FATES = list(Fate)
SHORTEST = ((0x80, b"", "B"), (0x100, b"\xcc", "B"), (0x10000, b"\xcd", ">H"), (1 << 32, b"\xce", ">I"))


def frame(number: int = 0, medium: str = "radio", data: bytes = b"hello") -> Frame:
    return Frame(medium, "r1", number, offered_ns=number * 1_000, data=data, on_air_ns=number * 1_000 + 10,
                 end_ns=number * 1_000 + 90)


def filled(path: Path | None, copies: int, chunk_rows: int = 7) -> Ledger:
    ledger = Ledger(path, metadata={"scenario": "two_robots", "seed": "7"}, chunk_rows=chunk_rows)
    for number in range(copies):
        ledger.expect(1, "radio")
        fate = FATES[number % len(FATES)]
        ledger.close(frame(number), f"r{number % 3}", fate, copy=number % 2, delivered_ns=number * 1_000 + 100,
                     cause="" if fate is Fate.DELIVERED else "impairment[0]")
    return ledger


def pack(value: Any) -> bytes:
    """MessagePack by hand, for what a row holds: short text, short bytes, and integers in their shortest form."""
    if isinstance(value, str):
        text = value.encode()
        assert len(text) < 32
        return bytes([0xA0 | len(text)]) + text
    if isinstance(value, bytes):
        return b"\xc4" + struct.pack("B", len(value)) + value
    for limit, mark, form in SHORTEST:
        if 0 <= value < limit:
            return mark + struct.pack(form, value)
    assert value == -1
    return b"\xff"


def pack_row(row: Sequence[Any]) -> bytes:
    return bytes([0x90 | len(row)]) + b"".join(pack(value) for value in row)


def test_the_hash_is_that_of_the_rows_packed_by_hand_one_after_the_other() -> None:
    ledger = filled(None, 40)

    result = ledger.finish()

    stream = b"".join(pack_row(row) for row in [COLUMNS, *ledger.rows])
    assert result.hash == blake2b(stream, digest_size=16).hexdigest()


@pytest.mark.parametrize("chunk_rows", [1, 15, 16, 17, 1000])
def test_the_hash_does_not_depend_on_the_size_of_a_chunk_or_on_writing(tmp_path: Path, chunk_rows: int) -> None:
    in_memory = filled(None, 100).finish()

    written = filled(tmp_path / "ledger.parquet", 100, chunk_rows).finish()

    assert written == in_memory


@pytest.mark.parametrize("items", [0, 1, 15, 16, 65_535, 65_536])
def test_the_header_that_is_cut_off_has_the_length_of_an_empty_encoding(items: int) -> None:
    import msgspec

    encoded = msgspec.msgpack.encode([0] * items)

    assert array_header_bytes(items) == len(encoded) - items


@pytest.mark.parametrize("column", range(len(COLUMNS)))
def test_the_hash_covers_every_column(column: int) -> None:
    row = ("radio", "r1", 3, "r2", 0, 10, 20, 30, 40, 5, b"digest", "delivered", "")
    value = row[column]
    other = value + 1 if isinstance(value, int) else value + value[:1] if value else "x"
    changed = row[:column] + (other,) + row[column + 1:]

    assert hash_of_rows([row]) != hash_of_rows([changed])


def test_the_hash_covers_the_order_of_the_rows() -> None:
    first, second = ("a", 1), ("b", 2)

    assert hash_of_rows([first, second]) != hash_of_rows([second, first])


def hash_of_rows(rows: list[tuple[Any, ...]]) -> str:
    total = LedgerHash(COLUMNS)
    total.add(rows)
    return total.hex()


def test_the_file_holds_every_row_in_order_and_says_what_it_is(tmp_path: Path) -> None:
    path = tmp_path / "ledger.parquet"
    kept = filled(None, 50)

    result = filled(path, 50).finish()

    columns = [column.to_pylist() for column in read_ledger(path).columns]
    assert list(zip(*columns, strict=True)) == list(kept.rows)
    assert read_metadata(path) == {"scenario": "two_robots", "seed": "7", "hash": result.hash, "rows": "50",
                                   "expected": "50"}
    assert hash_of(path) == result.hash


def test_the_file_has_the_ledgers_columns_and_is_read_with_dictionaries(tmp_path: Path) -> None:
    path = tmp_path / "ledger.parquet"
    filled(path, 3).finish()

    schema = read_ledger(path).schema

    assert tuple(schema.names) == COLUMNS == tuple(SCHEMA.names)
    for field in schema:
        if field.name.endswith("_ns"):
            assert field.type == pa.int64()
        if field.name in {"medium", "sender", "receiver", "fate", "cause"}:
            assert pa.types.is_dictionary(field.type)


def test_a_file_takes_a_fixed_part_and_the_digits_of_a_copy(tmp_path: Path) -> None:
    sizes = {}
    for copies in (50, 4050):
        filled(tmp_path / f"{copies}.parquet", copies, chunk_rows=10_000).finish()
        sizes[copies] = (tmp_path / f"{copies}.parquet").stat().st_size

    assert (sizes[4050] - sizes[50]) / 4000 <= 20       # 8 of digest, 3 times of at most 4
    assert sizes[50] - 50 * 20 <= 2_500                 # 13 columns: a page each, and its description in the footer


def test_text_columns_are_read_with_one_dictionary_for_all_chunks(tmp_path: Path) -> None:
    path = tmp_path / "ledger.parquet"
    filled(path, 50, chunk_rows=7).finish()

    table = read_ledger(path, ["fate", "receiver"])

    assert table.column_names == ["fate", "receiver"]
    for column in table.columns:
        assert pa.types.is_dictionary(column.type)
        assert len({tuple(chunk.dictionary.to_pylist()) for chunk in column.chunks}) == 1


def test_a_row_that_was_changed_in_the_file_is_found(tmp_path: Path) -> None:
    path = tmp_path / "ledger.parquet"
    recorded = filled(path, 20).finish().hash
    table = pq.read_table(path)
    where = COLUMNS.index("delivered_ns")
    later = pa.array([t + 1 for t in table["delivered_ns"].to_pylist()])

    pq.write_table(table.set_column(where, SCHEMA.field(where), later), path)

    assert hash_of(path) != recorded


def test_memory_holds_no_more_than_a_chunk_of_rows(tmp_path: Path) -> None:
    ledger = filled(tmp_path / "ledger.parquet", 100, chunk_rows=8)

    assert len(ledger.rows) == 100 % 8
    assert sum(ledger.closed.values()) == 100
    ledger.finish()


@given(st.lists(st.tuples(st.sampled_from(["radio", "can"]), st.sampled_from(FATES)), max_size=60))
@settings(max_examples=examples(50), deadline=None)
def test_copies_are_conserved_and_counted_by_medium_and_fate(ends: list[tuple[str, Fate]]) -> None:
    ledger = Ledger()
    for number, (medium, fate) in enumerate(ends):
        ledger.expect(1, medium)
        ledger.close(frame(number, medium), "r2", fate)

    result = ledger.finish()

    assert result.expected == result.rows == len(ends)
    for fate in Fate:
        count = sum(end[1] is fate for end in ends)
        assert result.by_fate.get(fate.value, 0) == ledger.closed[fate] == count
        for medium in ("radio", "can"):
            assert result.by_medium.get(medium, {}).get(fate.value, 0) == ends.count((medium, fate))


STEP = st.tuples(st.integers(0, 30), st.sampled_from(["r1", "r2", "r3"]), st.booleans(), st.booleans())


@given(st.lists(STEP, max_size=60), st.dictionaries(st.sampled_from(["r1", "r2"]), st.integers(0, 80)),
       st.integers(1, 20), st.integers(0, 100))
@settings(max_examples=examples(50), deadline=None)
def test_a_fate_is_settled_once_its_arrival_has_passed_and_is_final_then(
        tmp_path_factory: pytest.TempPathFactory, steps: list[tuple[int, str, bool, bool]], gone_ns: dict[str, int],
        chunk_rows: int, end_ns: int) -> None:
    """One copy is closed at each nanosecond and arrives up to 30 ns later; that a node is gone is said when it is."""
    path = tmp_path_factory.mktemp("ledger") / "ledger.parquet"
    now_ns, wanted, arrivals = 0, list[tuple[int, str, int]](), list[int]()
    ledger = Ledger(path, chunk_rows=chunk_rows, passed_ns=lambda: now_ns)
    for now_ns, (delay_ns, receiver, lost, keep) in enumerate(steps[:end_ns]):
        for name in (name for name, from_ns in gone_ns.items() if from_ns == now_ns):
            ledger.receiver_away(name, Absence(now_ns, NEVER_NS))
        arrival_ns = -1 if lost else now_ns + delay_ns
        said_gone = gone_ns.get(receiver, end_ns) < len(steps)
        fate = (Fate.LOST if lost else Fate.UNFINISHED if arrival_ns >= end_ns else
                Fate.RECEIVER_GONE if said_gone and arrival_ns >= gone_ns.get(receiver, end_ns) else Fate.DELIVERED)
        wanted.append((now_ns, fate.value, arrival_ns if fate is Fate.DELIVERED else -1))
        arrivals.append(arrival_ns)
        ledger.expect(1, "radio")
        ledger.close(frame(now_ns), receiver, Fate.LOST if lost else Fate.DELIVERED, delivered_ns=arrival_ns)
        assert ledger.closed.total() == now_ns + 1
        if keep:
            ledger.keep()
            noted = [row for batch in noted_batches(path) for row in batch.to_pylist()]
            assert len(noted) == next((n for n, row in enumerate(arrivals) if row >= now_ns), len(arrivals))
            assert [(row["number"], row["fate"], row["delivered_ns"]) for row in noted] == wanted[:len(noted)]

    result = ledger.finish(end_ns=end_ns)

    assert [(row["number"], row["fate"], row["delivered_ns"]) for row in read_ledger(path).to_pylist()] == wanted
    assert result.hash == hash_of(path)
    assert {fate.value: copies for fate, copies in ledger.closed.items()} == result.by_fate == dict(
        Counter(fate for _, fate, _ in wanted))


def test_a_copy_that_never_ends_is_an_error_with_both_numbers(tmp_path: Path) -> None:
    path = tmp_path / "ledger.parquet"
    ledger = filled(path, 10)
    ledger.expect(2)

    with pytest.raises(ConservationError, match=r"all media: 12 copies expected, 10 closed \(-2\)"):
        ledger.finish()

    assert read_ledger(path).num_rows == 10


def test_differences_of_two_media_that_cancel_are_found() -> None:
    ledger = Ledger()
    ledger.expect(2, "radio")
    ledger.close(frame(medium="can"), "r2", Fate.DELIVERED)
    ledger.close(frame(medium="radio"), "r2", Fate.DELIVERED)

    with pytest.raises(ConservationError, match=r"can: 0 .*, 1 closed \(\+1\); radio: 2 .*, 1 closed \(-1\)"):
        ledger.finish()


def test_a_run_that_was_broken_off_leaves_a_whole_file_and_no_error(tmp_path: Path) -> None:
    path = tmp_path / "ledger.parquet"
    ledger = filled(path, 10)
    ledger.expect(5)

    result = ledger.finish(complete=False)

    assert (result.expected, result.rows) == (15, 10)
    assert hash_of(path) == result.hash


def test_an_empty_ledger_finishes_and_reads_back_empty(tmp_path: Path) -> None:
    path = tmp_path / "ledger.parquet"

    result = Ledger(path).finish()

    assert (result.rows, result.by_fate) == (0, {})
    assert read_ledger(path).num_rows == 0
    assert hash_of(path) == result.hash == Ledger().finish().hash


def test_fates_are_listed_in_the_order_of_the_enumeration() -> None:
    ledger = Ledger()
    for fate in reversed(Fate):
        ledger.expect(1, "radio")
        ledger.close(frame(), "r2", fate)

    assert list(ledger.finish().by_fate) == [fate.value for fate in Fate]


def test_a_chunk_of_no_rows_is_refused() -> None:
    with pytest.raises(ValueError, match="chunk_rows=0: a chunk holds at least 1 row"):
        Ledger(chunk_rows=0)

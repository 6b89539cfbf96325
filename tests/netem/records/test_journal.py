"""Journals of a run that was killed: cut anywhere, all that was whole before the cut is read, and nothing else."""

from __future__ import annotations

import math
import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.events import Event
from netem.records.events_file import write_events
from netem.records.journal import GrowingFile, Journal, journal_of, pieces_of
from netem.records.ledger import Ledger
from netem.records.ledger_file import hash_of, read_ledger, read_metadata
from netem.records.signals import SignalFile, read_recording
from netem.wire.level import Level
from tests.examples import examples

EACH_CUT = settings(max_examples=examples(60), suppress_health_check=[HealthCheck.function_scoped_fixture])
CUT = st.floats(0, 1)


def close(ledger: Ledger, number: int) -> None:
    frame = Frame("radio", f"r{number % 3}", number, offered_ns=number * 1_000, data=bytes([number % 256]),
                  on_air_ns=number * 1_000 + 10, end_ns=number * 1_000 + 90)
    ledger.expect(1, "radio")
    ledger.close(frame, "r9", list(Fate)[number % len(Fate)], cause=f"impairments[{number % 5}]")


@contextmanager
def files_of_at_most(size_bytes: int) -> Iterator[None]:
    """What a full disk is to a program: no file can grow beyond `size_bytes`."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@given(batches=st.lists(st.integers(1, 40), min_size=1, max_size=8), cut=CUT)
@EACH_CUT
def test_a_ledger_cut_anywhere_gives_the_rows_of_its_whole_pieces(tmp_path: Path, batches: list[int], cut: float
                                                                   ) -> None:
    path = tmp_path / "ledger.parquet"
    path.unlink(missing_ok=True)
    ledger, ends, rows = Ledger(path), [], []
    for size in batches:
        for _ in range(size):
            close(ledger, len(rows))
            rows.append(len(rows))
        ledger.keep()
        ends.append((journal_of(path).stat().st_size, len(rows)))
    length = round(cut * ends[-1][0])
    os.truncate(journal_of(path), length)

    read = read_ledger(path)

    assert read["number"].to_pylist() == rows[:max((count for end, count in ends if end <= length), default=0)]


def test_what_is_kept_is_what_the_file_will_hold(tmp_path: Path) -> None:
    path = tmp_path / "ledger.parquet"
    ledger = Ledger(path, chunk_rows=7)
    for number in range(50):
        close(ledger, number)
    ledger.keep()

    kept, hash_kept = read_ledger(path).to_pylist(), hash_of(path)
    result = ledger.finish()

    assert kept == read_ledger(path).to_pylist()
    assert hash_kept == result.hash == read_metadata(path)["hash"]
    assert [file.name for file in tmp_path.iterdir()] == ["ledger.parquet"]


@given(batches=st.lists(st.integers(1, 40), min_size=1, max_size=6), cut=CUT)
@EACH_CUT
def test_signals_cut_anywhere_are_read_up_to_the_last_whole_piece(tmp_path: Path, batches: list[int], cut: float
                                                                  ) -> None:
    path = tmp_path / "signals.mcap"
    path.unlink(missing_ok=True)
    recorder, taken, ends = SignalFile(path), 0, []
    recorder.declare("r1", [("y", "1")])
    recorder.keep()
    for size in batches:
        for _ in range(size):
            recorder.append("r1", taken * 1000, (math.sin(taken),))
            recorder.event(Event(taken * 1000, "r1", "step", str(taken), Level.WARNING, wall_clock=bool(taken % 2)))
            taken += 1
        recorder.keep()
        ends.append((journal_of(path).stat().st_size, taken))
    length = round(cut * ends[-1][0])
    os.truncate(journal_of(path), length)

    recording = read_recording(path)

    whole = max((count for end, count in ends if end <= length), default=0)
    read = recording.signals["r1"].column("y").tolist() if "r1" in recording.signals else []
    assert read in ([math.sin(k) for k in range(count)] for count in {whole, *(n for _, n in ends)})
    assert recording.events == [Event(k * 1000, "r1", "step", str(k), Level.WARNING, bool(k % 2)) for k in range(whole)]
    assert len(read) >= whole       # samples stand before the events that were kept with them
    assert not recording.whole


def test_a_full_disk_leaves_the_rows_before_and_keeps_the_rest_for_later(tmp_path: Path) -> None:
    path = tmp_path / "ledger.parquet"
    ledger = Ledger(path)
    for number in range(100):
        close(ledger, number)
    ledger.keep()
    size_bytes = journal_of(path).stat().st_size
    for number in range(100, 200):
        close(ledger, number)

    with files_of_at_most(size_bytes + 100), pytest.raises(OSError, match="File too large"):
        ledger.keep()
    on_the_full_disk = read_ledger(path)["number"].to_pylist()
    result = ledger.finish()

    assert on_the_full_disk == list(range(100))
    assert read_ledger(path)["number"].to_pylist() == list(range(200))
    assert hash_of(path) == result.hash


def test_a_ledger_that_finds_no_room_for_its_file_leaves_its_journal_alone(tmp_path: Path) -> None:
    path = tmp_path / "ledger.parquet"
    ledger = Ledger(path)
    for number in range(20_000):
        close(ledger, number)
    ledger.keep()

    with files_of_at_most(2_000), pytest.raises(OSError, match="File too large"):
        ledger.finish()

    assert [file.name for file in tmp_path.iterdir()] == ["ledger.rows.part"]
    assert read_ledger(path).num_rows == 20_000


@pytest.mark.parametrize("kept", [0, 60, 100])
def test_rows_of_a_ledger_without_room_for_its_file_are_in_its_journal(tmp_path: Path, kept: int) -> None:
    path = tmp_path / "ledger.parquet"
    ledger = Ledger(path)
    frame = Frame("radio", "r1", 1, offered_ns=1, data=b"x", on_air_ns=2, end_ns=3)
    for _ in range(kept):
        ledger.close(frame, "r2", Fate.DELIVERED)
    ledger.keep()
    for _ in range(100 - kept):
        ledger.close(frame, "r2", Fate.DELIVERED)
    ledger.expect(100)

    with files_of_at_most(400), pytest.raises(OSError, match="File too large"):
        ledger.finish()         # 100 equal rows are smaller than what Parquet needs besides rows

    assert [file.name for file in tmp_path.iterdir()] == ["ledger.rows.part"]
    assert read_ledger(path).num_rows == 100


@pytest.mark.parametrize("kept", [0, 60, 100])
def test_signals_without_room_for_their_file_are_in_their_journal(tmp_path: Path, kept: int) -> None:
    path = tmp_path / "signals.mcap"
    recorder = SignalFile(path)
    recorder.declare("r1", [("y", "1")])
    for time_ns in range(100):
        recorder.append("r1", time_ns, (1.0,))
        if time_ns + 1 == kept:
            recorder.event(Event(time_ns, "r1", "step", "before", Level.WARNING))
            recorder.keep()
    recorder.event(Event(100, "r1", "step", "after", Level.WARNING))

    with files_of_at_most(1_200), pytest.raises(OSError, match="File too large"):
        recorder.finish({})     # MCAP's schemas alone are larger

    assert [file.name for file in tmp_path.iterdir()] == ["signals.rows.part"]
    recording = read_recording(path)
    assert recording.signals["r1"].column("y").tolist() == [1.0] * 100
    assert recording.events[-1].detail == "after"


def test_signals_that_find_no_room_are_read_up_to_there(tmp_path: Path) -> None:
    path = tmp_path / "signals.mcap"
    recorder = SignalFile(path)
    recorder.declare("r1", [("y", "1")])
    recorder.append("r1", 0, (1.0,))
    recorder.keep()
    recorder.append("r1", 1, (2.0,))

    with files_of_at_most(journal_of(path).stat().st_size + 10), pytest.raises(OSError, match="File too large"):
        recorder.finish({})

    assert read_recording(path).signals["r1"].column("y").tolist() == [1.0]


def test_no_record_has_its_name_before_it_is_whole(tmp_path: Path) -> None:
    recorder = SignalFile(tmp_path / "signals.mcap")
    ledger = Ledger(tmp_path / "ledger.parquet")
    recorder.declare("r1", [("y", "1")])
    recorder.append("r1", 0, (1.0,))
    recorder.keep()
    before = {file.name for file in tmp_path.iterdir()}

    ledger.finish()
    write_events(tmp_path / "ledger_events.parquet", recorder.events)
    recorder.finish({})

    assert before == {"signals.mcap.part", "signals.rows.part", "ledger.parquet.part", "ledger.rows.part"}
    assert {file.name for file in tmp_path.iterdir()} == {"signals.mcap", "ledger_events.parquet", "ledger.parquet"}


def test_a_growing_file_grows_by_whole_commits(tmp_path: Path) -> None:
    journal = GrowingFile(tmp_path / "journal")
    journal.write(b"first")
    journal.commit()
    journal.write(b"second piece")

    with files_of_at_most(8), pytest.raises(OSError, match="File too large"):
        journal.commit()
    after_the_failure = (tmp_path / "journal").read_bytes()
    journal.commit()
    journal.close()

    assert after_the_failure == b"first"
    assert (tmp_path / "journal").read_bytes() == b"firstsecond piece"


def test_a_ledger_of_two_robots_takes_at_most_20_bytes_a_copy(tmp_path: Path) -> None:
    """Two robots every 10 ms, the clock of one 100 ppm fast, 20 s: times that do not repeat, and digests of 8 bytes."""
    path = tmp_path / "ledger.parquet"
    ledger = Ledger(path)
    for number in range(2_000):
        for sender, offered_ns in (("r1", number * 10_000_000), ("r2", round((number * 10e6 + 2e5) / (1 + 1e-4)))):
            frame = Frame("radio", sender, number, offered_ns=offered_ns, data=number.to_bytes(8, "little"),
                          on_air_ns=offered_ns, end_ns=offered_ns + 76_000)
            ledger.close(frame, "r2" if sender == "r1" else "r1", Fate.DELIVERED, delivered_ns=offered_ns + 80_000)
    ledger.finish(complete=False)

    assert path.stat().st_size / 4_000 <= 20


def test_signals_of_two_robots_take_at_most_6_bytes_a_sample(tmp_path: Path) -> None:
    path = tmp_path / "signals.mcap"
    recorder = SignalFile(path)
    for node in ("r1", "r2"):
        recorder.declare(node, [("heard", "1")])
    for k in range(2_000):
        recorder.append("r1", k * 10_000_000, (k,))
        recorder.append("r2", k * 10_000_000, (k - 1,))
    recorder.finish({})

    assert path.stat().st_size / 4_000 <= 6


def test_a_file_that_a_program_has_closed_grows_on_and_another_with_its_number_stays(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "rows.part")
    journal.add(b"before")
    journal.commit()
    number = journal._file._descriptor
    os.close(number)
    other = os.open(tmp_path / "other", os.O_WRONLY | os.O_CREAT)

    journal.add(b"after")
    journal.commit()
    journal.close()
    journal.close()

    assert other == number
    os.close(other)
    assert (tmp_path / "other").read_bytes() == b""
    assert list(pieces_of(tmp_path / "rows.part")) == [b"before", b"after"]

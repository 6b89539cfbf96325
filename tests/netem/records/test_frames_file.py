"""Kept frames: what media told is read back; a killed run has all whole pieces; a full disk and a damaged file."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from netem.core.frame import Frame
from netem.records import Feed, NoSettings, Place
from netem.records import frames_file as module
from netem.records.frames_file import FILE, FrameRecorder, KeptFrame, NoFrames, frame_table, frames_of
from netem.records.journal import journal_of
from tests.examples import examples
from tests.netem.records.test_journal import files_of_at_most

END_NS = 10**9


def recorder(folder: Path) -> FrameRecorder:
    found = FrameRecorder(NoSettings(), Place(folder, {"scenario": "s", "seed": "1"}, b"", END_NS))
    feed = Feed({"radio": [], "bus": []})
    found.record(feed)
    assert feed.frames == {"radio": [found], "bus": [found]}
    return found


def kept(number: int) -> KeptFrame:
    if number % 7 == 6:
        return KeptFrame("bus", "", -1, *(number * 1000,) * 4, b"")
    data = random.Random(number).randbytes(number % 40)
    return KeptFrame("radio", f"r{number % 3}", number, number * 1000, number * 1000 + 10, number * 1000 + 90,
                     number * 1000 + 95, data)


def tell(taken: FrameRecorder, row: KeptFrame) -> None:
    if row.sender:
        taken.frame(Frame(row.medium, row.sender, row.number, row.offered_ns, row.data, row.on_air_ns, row.end_ns),
                    row.seen_ns)
    else:
        taken.error_frame(row.medium, row.on_air_ns)


def read(folder: Path) -> list[KeptFrame]:
    return list(frames_of(frame_table(folder)))


@pytest.mark.parametrize("chunk", [3, 1000])
def test_what_media_told_is_read_back(tmp_path: Path, chunk: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CHUNK_FRAMES", chunk)
    taken = recorder(tmp_path)
    for number in range(100):
        tell(taken, kept(number))
        if number % 10 == 9:
            taken.keep()
    assert read(tmp_path) == [kept(number) for number in range(100)]      # from the journal
    tell(taken, KeptFrame("radio", "late", 0, 0, 0, END_NS, END_NS, b"x"))

    taken.finish()

    assert read(tmp_path) == [kept(number) for number in range(100)]
    assert [file.name for file in tmp_path.iterdir()] == [FILE]


def test_a_chunk_is_full_by_its_bytes_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CHUNK_BYTES", 100)
    taken = recorder(tmp_path)

    for number in range(30):
        tell(taken, kept(number))

    assert sum(len(row.data) for row in taken._rows) < 100
    taken.finish()
    assert read(tmp_path) == [kept(number) for number in range(30)]


@given(batches=st.lists(st.integers(1, 40), min_size=1, max_size=8), cut=st.floats(0, 1))
@settings(max_examples=examples(40), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_journal_cut_anywhere_gives_the_frames_of_its_whole_pieces(tmp_path: Path, batches: list[int], cut: float
                                                                     ) -> None:
    (tmp_path / FILE).unlink(missing_ok=True)
    taken, count, ends = recorder(tmp_path), 0, []
    for size in batches:
        for _ in range(size):
            tell(taken, kept(count))
            count += 1
        taken.keep()
        ends.append((journal_of(tmp_path / FILE).stat().st_size, count))
    length = round(cut * ends[-1][0])
    os.truncate(journal_of(tmp_path / FILE), length)

    found = read(tmp_path)

    assert found == [kept(k) for k in range(max((count for end, count in ends if end <= length), default=0))]


def test_a_full_disk_leaves_the_frames_before_and_keeps_the_rest_for_later(tmp_path: Path) -> None:
    taken = recorder(tmp_path)
    for number in range(100):
        tell(taken, kept(number))
    taken.keep()
    size_bytes = journal_of(tmp_path / FILE).stat().st_size
    for number in range(100, 200):
        tell(taken, kept(number))

    with files_of_at_most(size_bytes + 100), pytest.raises(OSError, match="File too large"):
        taken.keep()
    on_the_full_disk = read(tmp_path)
    taken.finish()

    assert on_the_full_disk == [kept(number) for number in range(100)]
    assert read(tmp_path) == [kept(number) for number in range(200)]


@pytest.mark.parametrize("content", [b"", b"PAR1", b"not a table at all", bytes(1000)])
def test_a_damaged_file_is_an_error_of_one_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / FILE).write_bytes(content)

    with pytest.raises(NoFrames, match=r"frames\.parquet: cannot be read .* run the scenario again") as error:
        frame_table(tmp_path)

    assert "\n" not in str(error.value)


def test_without_frames_the_error_names_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(NoFrames, match='write `record = "frames"` at the top of its scenario'):
        frame_table(tmp_path)

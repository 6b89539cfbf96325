from __future__ import annotations

import pytest

from netem.impairments.csv_columns import RecordingError, read_columns


@pytest.fixture
def read(tmp_path):
    def written(text: str | bytes):
        path = tmp_path / "values.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_columns(str(path), times=["time", "delay"], ratios=["lost"])

    return written


def test_times_become_nanoseconds_by_their_unit_without_a_detour_through_binary_fractions(read):
    columns = read("time_s, delay_us,lost\n0.1,0.3,0\n123456789.000000001,1e3,1\n\n")

    assert columns == {"time_ns": [100_000_000, 123_456_789_000_000_001], "delay_ns": [300, 1_000_000], "lost": [0, 1]}


def test_all_problems_come_at_once_with_their_lines(read):
    with pytest.raises(RecordingError) as refusal:
        read("delay_s,lost\nabc,0\n-1,2\n1\nnan,0\n")

    assert [line.split("values.csv")[1] for line in str(refusal.value).splitlines()] == [
        ":2: delay_s=abc: expected a number >= 0",
        ":3: delay_s=-1: expected a number >= 0",
        ":5: delay_s=nan: expected a number >= 0",
        ":3: lost=2: expected a number from 0 to 1",
        ":4: lost=nothing: expected a number from 0 to 1",
    ]


def test_a_long_list_of_problems_is_cut(read):
    with pytest.raises(RecordingError, match="and 90 more"):
        read("delay_s\n" + "x\n" * 100)


@pytest.mark.parametrize(("text", "message"), [
    ("", "empty: expected a header and rows"),
    ("delay_s\n", "no rows below the header"),
    ("delay\n1\n", "column 'delay' is not known, nearest: delay_"),
    ("delay_s,delay_ms\n1,1\n", "column 'delay_ms': delay stands there twice"),
    (b"\xff\xfe\x00", "cannot be read as CSV"),
])
def test_a_file_that_is_no_table_is_refused(text, message, read):
    with pytest.raises(RecordingError, match=message):
        read(text)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(RecordingError, match=r"gone\.csv: cannot be read"):
        read_columns(str(tmp_path / "gone.csv"), times=["delay"], ratios=[])

from __future__ import annotations

from fractions import Fraction

import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.impairments.csv_columns import RecordingError, all_at_once, one_ns, read_columns
from netem.wire.instants import NEVER_NS, NS_PER
from tests.examples import examples


@pytest.fixture
def read(tmp_path):
    def written(text: str | bytes, columns=None):
        path = tmp_path / "values.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_columns(str(path), times=["time", "delay"], ratios=["probability"], flags=True, columns=columns)

    return written


def test_times_become_nanoseconds_by_their_unit_without_a_detour_through_binary_fractions(read):
    columns = read("time_s, delay_us,lost\n0.1,0.3,0\n123456789.000000001,1e3,1\n\n")

    assert columns.times_ns["time"].tolist() == [100_000_000, 123_456_789_000_000_001]
    assert columns.times_ns["delay"].tolist() == [300, 0]
    assert columns.lost.tolist() == [False, True]


decimals = st.decimals(-10**11, 10**11, places=20) | st.decimals(-1, 1, places=13) | st.integers(-10**9, 10**9)
texts = decimals.map(str) | st.from_regex(r"[+-]?[0-9]{0,12}\.?[0-9]{0,22}([eE][+-]?[0-9]{1,3})?", fullmatch=True)


@settings(max_examples=examples(150), deadline=None)
@given(texts, st.sampled_from(list(NS_PER)))
def test_a_column_at_once_and_value_by_value_give_the_same_nanoseconds(text, unit):
    try:
        at_once = all_at_once(pa.chunked_array([[text]]), unit).tolist()
    except pa.ArrowInvalid:
        return                                  # then the values are taken one by one

    assert at_once == [one_ns(text, unit)]


@settings(max_examples=examples(150), deadline=None)
@given(decimals, st.sampled_from(list(NS_PER)))
def test_a_time_is_rounded_to_the_nearest_nanosecond(number, unit):
    exact_ns = Fraction(number) * NS_PER[unit]

    found_ns = one_ns(str(number), unit)

    assert found_ns is None if abs(exact_ns) >= NEVER_NS else abs(found_ns - exact_ns) <= Fraction(1, 2)


def test_all_problems_come_at_once_with_their_lines(read):
    with pytest.raises(RecordingError) as refusal:
        read("delay_s,lost\nabc,0\n\n-1,2\n1\nnan,0\n,0\n")
    with pytest.raises(RecordingError) as uneven:
        read("delay_s,lost\n1,0\n\n1\n1,0,\n")

    assert [line.split("values.csv")[1] for line in str(refusal.value).splitlines()] == [
        ":5: 1 value in the row: expected 2, as the header has (comma-separated)"]
    assert [line.split("values.csv")[1] for line in str(uneven.value).splitlines()] == [
        ":4: 1 value in the row: expected 2, as the header has (comma-separated)",
        ":5: 3 values in the row: expected 2, as the header has (comma-separated)"]


def test_every_value_that_is_none_is_named_with_its_line_and_rule(read):
    with pytest.raises(RecordingError) as refusal:
        read("# a comment\ndelay_s,lost\nabc,0\n\n-1,2\nnan,0\n,0\n1,maybe\n")

    rule = "expected a number >= 0 (only a copy that a column `lost` gives as 1 needs none)"
    assert [line.split("values.csv")[1] for line in str(refusal.value).splitlines()] == [
        ":5: lost=2: expected 0 or 1, false or true",
        ":8: lost=maybe: expected 0 or 1, false or true",
        f":3: delay_s=abc: {rule}", f":5: delay_s=-1: {rule}", f":6: delay_s=nan: {rule}",
        f":7: delay_s=nothing: {rule}"]


@pytest.mark.parametrize("text", [
    "delay_ms,lost\n10,0\n,1\n11,0\n",
    "delay_ms,lost\n10,false\nNaN,TRUE\n11,False\n",
    "delay_ms,lost\n10,0.0\n-1,1.0\n11,0\n",
    "delay_ms,received\n10,1\ninf,0\n11,true\n",
    "seq\tdelay_ms\tlost\nx\t10\t0\ny\t\t1\nz\t11\t0\n",
    "delay_ms;lost;note\n10,0;0;\n;1;what\n11,0;0;\n",
    "delay_ms;lost\n10.0;0\n;1\n11.0;0\n",
    "\n# ping -D\n# more\nlost,lat,delay_ms,\n0,47.1,10,\n1,47.1,,\n0,,11,\n",
    " Delay_ms , LOST\r\n 10 , 0 \r\n\r\n,1\r\n11,0",
    "\ufeffdelay_ms,lost\n10,0\n,1\n11,0\n",
    "delay_ms,lost\n10,0\n,1\n11,0\n".encode("utf-16"),
    b"delay_ms,lost,caf\xe9\n10,0,\xff\n,1,\n11,0,\n",
], ids=lambda text: repr(text)[:24])
def test_field_recordings_are_read_as_they_are(read, text):
    columns = read(text)

    assert columns.lost.tolist() == [False, True, False]
    assert columns.times_ns["delay"].tolist() == [10_000_000, 0, 11_000_000]


def test_others_names_and_units_are_mapped(read):
    columns = read("t,rtt,ok,time_s\n1,2.5,1,7\n2,,0,8\n", {"time_ms": "t", "delay_us": "rtt", "received": "ok"})

    assert columns.times_ns["time"].tolist() == [1_000_000, 2_000_000]
    assert columns.times_ns["delay"].tolist() == [2_500, 0]
    assert columns.lost.tolist() == [False, True]


@pytest.mark.parametrize(("columns", "message"), [
    ({"delay_ms": "rt"}, r"values.csv:1: no column 'rt', as columns.delay_ms says; nearest: rtt$"),
    ({"delai_ms": "rtt"}, r"^columns=delai_ms: no column of this kind; nearest: delay_ms$"),
    ({}, r"values.csv:1: none of its columns is known \(t, rtt; separated by comma\): expected one of time_s, "),
])
def test_a_name_that_is_not_there_is_refused_with_the_nearest(read, columns, message):
    with pytest.raises(RecordingError, match=message):
        read("t,rtt\n1,2\n", columns)


def test_a_long_list_of_problems_is_cut(read):
    with pytest.raises(RecordingError, match="and 90 more"):
        read("delay_s\n" + "x\n" * 100)


@pytest.mark.parametrize(("text", "message"), [
    ("", "empty: expected a header and rows"),
    ("delay_s\n", "no rows below the header"),
    ("delay\n1\n", "none of its columns is known .delay; separated by comma.: expected one of time_s, "),
    ("delay_s,delay_ms\n1,1\n", "column 'delay_ms': delay stands there twice, also as 'delay_s'; name the one to use"),
    ("delay_s,lost,received\n1,1,0\n", "columns 'lost' and 'received' both tell which copies are lost; remove one"),
    (b"\xff\xfe\x00", "cannot be read as CSV"),
    (b"delay_s\n\xff\n", "cannot be read as CSV: .* invalid UTF8"),
])
def test_a_file_that_is_no_table_is_refused(text, message, read):
    with pytest.raises(RecordingError, match=message):
        read(text)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(RecordingError, match=r"gone\.csv: cannot be read"):
        read_columns(str(tmp_path / "gone.csv"), times=["delay"], ratios=[])

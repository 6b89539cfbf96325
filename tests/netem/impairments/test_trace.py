from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest

from netem.core.transit import Transit
from netem.impairments.csv_columns import RecordingError
from netem.impairments.recordings import Recordings
from netem.impairments.trace import Trace, TraceEnded

BY_FRAME = "delay_ms,lost\n1,0\n2.5,0\n9,1\n0.000001,0\n"
BY_TIME = "time_s,delay_us,lost\n0,7,0\n1,8,0\n1.5,0,1\n2,9,0\n"


@pytest.fixture
def recording(tmp_path):
    def write(text: str) -> str:
        path = tmp_path / "trace.csv"
        path.write_text(text)
        return str(path)

    return write


def replayed(trace, transits):
    """The delay of each, None where it was lost."""
    return [next((copy.arrival_ns - transit.arrival_ns for copy in trace.carry(transit)), None) for transit in transits]


def test_row_n_is_for_frame_n_and_a_wrapped_trace_starts_again(recording, frames):
    trace = Trace(recording(BY_FRAME))

    assert replayed(trace, frames(9)) == [1_000_000, 2_500_000, None, 1, 1_000_000, 2_500_000, None, 1, 1_000_000]


def test_a_held_trace_repeats_its_last_row(recording, frames):
    trace = Trace(recording(BY_FRAME), at_end="hold")

    assert replayed(trace, frames(7)) == [1_000_000, 2_500_000, None, 1, 1, 1, 1]


def test_a_trace_that_must_not_end_stops_the_run_and_says_where(recording, frames):
    trace = Trace(recording(BY_FRAME), at_end="error")

    assert replayed(trace, frames(4)) == [1_000_000, 2_500_000, None, 1]
    with pytest.raises(TraceEnded, match=r"trace.csv: frame 4 lies past the end \(4\): record longer"):
        list(trace.carry(frames(5)[4]))


S = 1_000_000_000


@pytest.mark.parametrize(("at_end", "past"), [("wrap", [7000, 7000, 8000, None, 9000]), ("hold", [9000] * 5)])
def test_rows_hold_from_their_time_to_the_next_and_the_last_as_long_as_the_one_before(at_end, past, recording):
    trace = Trace(recording(BY_TIME), by="time", at_end=at_end)
    inside = [0, S - 1, S, 3 * S // 2 - 1, 3 * S // 2, 2 * S - 1, 2 * S, 5 * S // 2 - 1]
    beyond = [5 * S // 2, 7 * S // 2 - 1, 7 * S // 2, 4 * S, 9 * S // 2]

    found = replayed(trace, [Transit(0, at_ns, at_ns, b"") for at_ns in inside + beyond])

    assert found == [7000, 7000, 8000, 8000, None, None, 9000, 9000] + past


def test_a_trace_by_time_looks_when_the_copy_entered_not_when_it_arrives(recording):
    trace = Trace(recording(BY_TIME), by="time")

    assert replayed(trace, [Transit(0, 0, 3 * S // 2, b"")]) == [7000]


def test_delay_or_loss_may_be_missing(recording, frames):
    assert replayed(Trace(recording("lost\n0\n1\n")), frames(3)) == [0, None, 0]
    assert replayed(Trace(recording("delay_ns\n3\n4\n")), frames(3)) == [3, 4, 3]


@pytest.mark.parametrize(("text", "by", "message"), [
    ("time_s\n0\n1\n", "frame", "neither delay_s .* nor lost .* among time_s"),
    ("delay_s,lost\n0,0.5\n", "frame", "trace.csv:2: lost=0.5: expected 0 or 1"),
    ("delay_s\n0\n", "time", "by=time needs a column time_s"),
    ("time_s,lost\n0,0\n", "time", "needs two rows"),
    ("time_s,lost\n0,0\n2,0\n2,0\n", "time",
     "trace.csv:4: the time does not rise: 2000000000 ns after 2000000000 ns; sort the rows"),
])
def test_a_trace_that_cannot_be_replayed_is_refused(text, by, message, recording):
    with pytest.raises(RecordingError, match=message):
        Trace(recording(text), by=by)


@pytest.mark.parametrize("start", ["1712345678.25", "0", "-3.5"])
def test_time_counts_from_the_first_row(recording, start):
    rows = [(Decimal(start) + Decimal(k) / 2, 10 + k) for k in range(3)]
    trace = Trace(recording("time_s,delay_ns\n" + "".join(f"{at},{delay}\n" for at, delay in rows)), by="time")

    found = replayed(trace, [Transit(0, at_ns, at_ns, b"") for at_ns in (0, S // 2 - 1, S // 2, S, 3 * S // 2)])

    assert found == [10, 10, 11, 12, 10]


def test_time_counts_from_the_instant_that_a_key_names_and_rows_before_it_are_passed_over(recording):
    file = recording("time_s,delay_ns\n1700000000,10\n1700000001,11\n1700000002,12\n1700000004,13\n")
    trace = Trace(file, by="time", start_ns=1_700_000_001 * S + S // 2)

    found = replayed(trace, [Transit(0, at_ns, at_ns, b"") for at_ns in (
        0, S // 2 - 1, S // 2, 5 * S // 2, 9 * S // 2 - 1, 9 * S // 2)])

    assert found == [11, 11, 12, 13, 13, 11]        # ends at 1700000006 s, 4.5 s after the start, and starts again


@pytest.mark.parametrize("start_s", [1_699_999_999, 1_700_000_006])
def test_a_start_outside_the_recording_is_refused(recording, start_s):
    file = recording("time_s,delay_ns\n1700000000,10\n1700000002,12\n1700000004,13\n")

    with pytest.raises(RecordingError, match="begins at 1700000000000000000 ns and ends at 1700000006000000000 ns"):
        Trace(file, by="time", start_ns=start_s * S)


def test_a_start_belongs_to_a_trace_by_time(recording):
    with pytest.raises(ValueError, match='start_ns=0: belongs to by = "time"'):
        Trace(recording(BY_FRAME), start_ns=0)


def test_impairments_that_share_recordings_read_a_file_once(recording, monkeypatch):
    file, shared, reads = recording(BY_TIME), Recordings(), []
    read_bytes = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: reads.append(path) or read_bytes(path))

    traces = [Trace(file, by="time", recordings=shared) for _ in range(56)]
    by_frame = Trace(file, recordings=shared)

    assert len(reads) == 2                          # once by time, once by frame
    assert len({id(trace._delays_ns) for trace in traces}) == 1
    assert replayed(by_frame, [Transit(1, 0, 0, b"")]) == replayed(traces[5], [Transit(1, S, S, b"")]) == [8000]

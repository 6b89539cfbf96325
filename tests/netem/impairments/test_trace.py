from __future__ import annotations

import pytest

from netem.impairments.csv_columns import RecordingError
from netem.impairments.trace import Trace, TraceEnded
from netem.transit import Transit

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
    ("time_s\n0\n1\n", "frame", "neither delay_s .* nor lost"),
    ("delay_s,lost\n0,0.5\n", "frame", "lost: expected 0 or 1"),
    ("delay_s\n0\n", "time", "by=time needs a column time_s"),
    ("time_s,lost\n1,0\n2,0\n", "time", "time starts at 1000000000 ns: expected 0"),
    ("time_s,lost\n0,0\n", "time", "needs two rows"),
    ("time_s,lost\n0,0\n2,0\n2,0\n", "time", "row 3: time does not rise"),
])
def test_a_trace_that_cannot_be_replayed_is_refused(text, by, message, recording):
    with pytest.raises(RecordingError, match=message):
        Trace(recording(text), by=by)

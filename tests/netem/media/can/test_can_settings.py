"""What a scenario may say of a CAN bus, and what is refused before the start with place, value, rule and remedy."""

from __future__ import annotations

from pathlib import Path

import can
import pytest

from experiments.scenario.loader import load
from experiments.scenario.problems import ScenarioError
from netem.media.can.messages import CanMessage, late_messages
from netem.media.can.settings import CanSettings
from tests.netem.media.can.can_bench import MS, CanBench

PROGRAM = """
from dataclasses import dataclass

from netem.media.can.frame import CanFrame, pack


class Talker:
    @dataclass
    class Settings:
        can_id: int
        period_ns: int
        size: int = 8

    def __init__(self, board, settings):
        port = board.port("can", lambda frame: board.count("heard"), listen_only=True)
        frame = pack(CanFrame(settings.can_id, bytes(settings.size)))
        board.every(settings.period_ns, lambda: port.send(frame))
"""
SCENARIO = """# Two talkers on one CAN bus.
# Question: do they get through?
seed = 3
length_s = 0.5

[agents.a]
program = "talkers:Talker"
parameters = { can_id = 0x120, period_ms = 10 }

[agents.b]
program = "talkers:Talker"
parameters = { can_id = 0x121, period_ms = 5 }

[media.can]
kind = "can"
bit_rate_bps = 500_000
"""


@pytest.fixture
def scenario(tmp_path: Path):  # type: ignore[no-untyped-def]
    (tmp_path / "talkers.py").write_text(PROGRAM)

    def write(*lines: str) -> Path:
        (tmp_path / "bus.toml").write_text(SCENARIO + "\n".join(lines))
        return tmp_path / "bus.toml"

    return write


def problems_of(path: Path) -> list[str]:
    with pytest.raises(ScenarioError) as raised:
        load(path)
    return raised.value.problems


@pytest.mark.parametrize(("lines", "said"), [
    (["data_bit_rate_bps = 100_000"], "bus.toml: media.can.data_bit_rate_bps=100000: expected bit_rate_bps=500000 to"),
    (["queue = \"lifo\""], "media.can.queue=\"lifo\": expected 'priority', 'fifo' or 'mailbox'"),
    (["queue_frames = 0"], "media.can.queue_frames=0: expected at least 1"),
    (["own_frames_to = [\"z\"]"], "own_frames_to=z: no such node on this bus; there are a, b"),
    (["baud = 5"], "media.can.baud=5: unknown key"),
    (["bit_errors = { ratio = 1.5 }"], "media.can.bit_errors.ratio=1.5: expected 0 <= ratio < 1"),
    (["bit_errors = { ratio = 0.1, during_s = [2.0, 1.0] }"], "expected 0 <= start < end"),
    (["bit_errors = { scripted = [{ frame = 1, bit = 2 }] }"], "media.can.bit_errors.scripted[0].frame=1: unknown key"),
    (["messages_only = true"], "no messages are declared"),
    (["[media.can.messages.speed]", "id = 0x800", "sender = \"a\"", "period_ms = 10"],
     "media.can.messages.speed.id=0x800: expected 11 bits; or extended"),
    (["[media.can.messages.speed]", "id = 0x80", "sender = \"a\"", "period_ms = 10", "length_bytes = 12"],
     "media.can.messages.speed.length_bytes=12: classical CAN carries 0 to 8; or set fd"),
    (["[media.can.messages.speed]", "id = 0x80", "sender = \"a\"", "period_ms = 10", "length_bytes = 12", "fd = true"],
     "messages: speed is CAN FD, which needs data_bit_rate_bps"),
    (["[media.can.messages.speed]", "id = 0x80", "sender = \"z\"", "period_ms = 10"],
     "messages: speed: sender=z: no such node on this bus"),
    (["[media.can.messages]", "x = { id = 5, sender = \"a\", period_ms = 9 }",
      "y = { id = 5, sender = \"b\", period_ms = 9 }"], "messages: x and y have the same identifier 0x5"),
])
def test_mistakes_are_named(scenario, lines: list[str], said: str) -> None:  # type: ignore[no-untyped-def]
    found = problems_of(scenario(*lines))

    assert any(said in line for line in found), found


def test_a_bit_rate_that_cannot_carry_the_messages_is_refused_with_the_utilization(scenario) -> None:  # type: ignore[no-untyped-def]
    """Two messages of 8 bytes: 135 bits at most, 111 at least, each millisecond and 0.3 ms: 270 + 900 us of 1000."""
    path = scenario("[media.can.messages]", "one = { id = 0x120, sender = \"a\", period_ms = 1.0 }",
                    "two = { id = 0x121, sender = \"b\", period_us = 300 }")

    (line,) = problems_of(path)

    assert "bus.toml: media.can.bit_rate_bps=500000: the 2 declared messages need 117.0% of it" in line
    assert "(96.2% without stuff bits)" in line
    assert "raise it, lengthen periods" in line
    assert load(scenario("overload = \"report\"", path.read_text().split("bit_rate_bps = 500_000\n")[1])).media


def test_a_run_leaves_logs_load_counters_and_events(scenario, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    from experiments.judge.run_data import load_run
    from experiments.run.runner import run

    path = scenario("log = [\"candump\", \"blf\"]", "load_window_ms = 50", "bit_errors = { scripted = [",
                    "{ transmission = 2, bit = 40 }] }", "[expect]", "\"can.load.max\" = { min = 0.05, max = 0.2 }",
                    "\"count.can.error_frames\" = { min = 1, max = 1 }",
                    "\"count.a.can.transmit_errors\" = { max = 1 }",
                    "\"can.frames_delivered\" = { min = 150 }")

    result = run(load(path), host="inline", out=tmp_path / "run", report=False)

    data = load_run(tmp_path / "run")
    logs = [list(reader(tmp_path / "run" / name)) for reader, name in
            ((can.CanutilsLogReader, "can.log"), (can.BLFReader, "can.blf"))]
    delivered = len(data.ledger.only(receiver="b")) + len(data.ledger.only(receiver="a"))
    assert all(verdict.holds for verdict in result.summary.verdicts)
    assert delivered == 150
    assert [sum(message.is_error_frame for message in log) for log in logs] == [1, 1]
    assert [len(log) for log in logs] == [151, 151]
    assert data.counters["can"]["transmissions"] == 151
    assert [(event.node, event.kind) for event in data.events] == [("b", "CAN error frame")]
    assert data.signals["can"].time_ns.tolist() == [50 * MS * (k + 1) for k in range(10)]


# --- deadlines

def test_messages_that_may_miss_their_deadline_are_told_at_the_start() -> None:
    """Davis et al. 2007, the three messages: the last one answers in 3.5 ms at worst, and has 3.25 ms. 4 bytes and the
    worst stuffing are 95 bits; at 95 kbit/s one takes 1 ms as in the paper."""
    ids = {"A": 0x100, "B": 0x200, "C": 0x300}
    messages = {name: CanMessage(can_id, 2500_000 if name == "A" else 3500_000, "a", 4,
                                 deadline_ns=2500_000 if name == "A" else 3250_000) for name, can_id in ids.items()}

    bench = CanBench(bit_rate_bps=95_000, messages=messages)

    assert [(time_ns, kind) for time_ns, _, kind, _ in bench.events] == [(0, "message may be late")]
    assert bench.events[0][3] == ("can: C (0x300): worst-case response time is 3.500 ms, deadline 3.250 ms")


def test_a_message_without_a_bound_is_told_too() -> None:
    messages = {"A": CanMessage(1, MS, "a"), "B": CanMessage(2, MS, "a")}
    settings = CanSettings(200_000, messages=messages, overload="report")

    assert late_messages(settings.messages, settings.clock) == [
        "A (0x1): worst-case response time is 1.350 ms, deadline 1.000 ms",
        "B (0x2): worst-case response time has no bound, deadline 1.000 ms"]

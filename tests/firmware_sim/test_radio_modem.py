"""A pair of radio modems: packetization by hand, and whole runs over serial lines and an XBee's radio."""

from math import ceil
from pathlib import Path
from random import Random

import pyarrow.parquet as pq
import pytest

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.radio_modem import RadioModem
from firmware_sim.radio_modem_settings import ModemSettings
from netem.media.radio_presets import PRESETS
from netem.node.node import Node
from netem.wire.messages import Grant

US, MS = 1_000, 1_000_000
BYTE_NS = 100 * US              # 8N1 at 100 kbit/s


def modem(arrivals, **parameters):
    """(time_ns, port, data) of what the modem hands out for these (time_ns, port, data); port 0 serial, 1 radio."""
    node = Node("modem", ["uart", "air"])
    board = Board(node, LocalClock(ClockSettings(), node.env.time_ns), None, {}, Random(1), {})
    RadioModem(board, ModemSettings("uart", "air", **{"baud_bps": 100_000, **parameters}))
    return node.advance(Grant(1, 1_000 * MS, False, True, arrivals)).offers


def test_a_packet_leaves_after_three_byte_times_of_silence():
    assert modem([(1 * MS, 0, b"abc")]) == [(1 * MS + 3 * BYTE_NS, 1, b"abc")]


def test_bytes_that_follow_in_time_are_in_the_same_packet_and_later_ones_are_not():
    sent = modem([(0, 0, b"a"), (2 * BYTE_NS, 0, b"b"), (5 * BYTE_NS, 0, b"c"), (9 * BYTE_NS, 0, b"d")])

    # c comes when the silence of b is just over: the packet without it has not left, arrivals come first
    assert sent == [(8 * BYTE_NS, 1, b"abc"), (12 * BYTE_NS, 1, b"d")]


def test_a_full_packet_leaves_at_once():
    data = bytes(range(250))

    assert modem([(0, 0, data)]) == [(0, 1, data[:100]), (0, 1, data[100:200]), (3 * BYTE_NS, 1, data[200:])]


def test_without_a_time_of_silence_every_chunk_leaves_at_once():
    assert modem([(0, 0, b"a"), (5, 0, b"b")], idle_bytes=0) == [(0, 1, b"a"), (5, 1, b"b")]


def test_what_the_radio_hears_goes_to_the_serial_line():
    assert modem([(7, 1, b"xyz")]) == [(7, 0, b"xyz")]


@pytest.mark.parametrize("wrong", [{"packet_bytes": 0}, {"idle_bytes": -1}, {"baud_bps": 0}])
def test_nonsense_is_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        modem([], **wrong)


TALKER = """
from dataclasses import dataclass


class Talker:
    @dataclass
    class Settings:
        line: str
        say: int = 0

    def __init__(self, board, settings):
        port = board.port(settings.line, lambda data: board.event("heard", data.hex()), listen_only=True)
        for k in range(settings.say):
            board.at(k * 100_000_000, lambda k=k: port.send(bytes([k]) * 21))
"""
SCENARIO = """# Two machines talk through a pair of radio modems.
# Question: when does what one says arrive at the other?
seed = 1
length_s = 1.0
[agents.vehicle]
program = "talker:Talker"
parameters = { line = "vehicle_uart", say = 5 }
media = ["vehicle_uart"]
[agents.vehicle_modem]
program = "firmware_sim.radio_modem:RadioModem"
parameters = { serial = "vehicle_uart", radio = "air", baud_bps = 57_600 }
media = ["vehicle_uart", "air"]
[agents.ground_modem]
program = "firmware_sim.radio_modem:RadioModem"
parameters = { serial = "ground_uart", radio = "air", baud_bps = 57_600 }
media = ["air", "ground_uart"]
[agents.ground]
program = "talker:Talker"
parameters = { line = "ground_uart" }
media = ["ground_uart"]
[media.vehicle_uart]
kind = "serial_line"
baud_bps = 57_600
chunk_bytes = 3
[media.ground_uart]
kind = "serial_line"
baud_bps = 57_600
chunk_bytes = 3
[media.air]
kind = "broadcast_radio"
preset = "xbee_802154"
"""


@pytest.fixture
def pair(tmp_path: Path) -> Path:
    (tmp_path / "talker.py").write_text(TALKER, encoding="utf-8")
    (tmp_path / "pair.toml").write_text(SCENARIO, encoding="utf-8")
    return tmp_path / "pair.toml"


def writes(result):
    """(time of the last chunk, data) of what the ground heard of each write: 21 bytes in 7 chunks."""
    heard = [(event.time_ns, event.detail) for event in load_run(result.folder).events if event.node == "ground"]
    return [(heard[k + 6][0], "".join(data for _, data in heard[k:k + 7])) for k in range(0, len(heard), 7)]


def test_what_one_says_arrives_after_the_line_the_silence_the_airtime_and_the_line(pair, tmp_path):
    runs = [run(load(pair), host=host, out=tmp_path / host, report=False) for host in ("inline", "process")]

    heard = writes(runs[0])
    line_ns = ceil(21 * 10 * 10**9 / 57_600)
    silence_ns = ceil(3 * 10 * 10**9 / 57_600)
    way_ns = line_ns + silence_ns + PRESETS["xbee_802154"].airtime_ns(21) + line_ns
    assert heard == [(k * 100 * MS + way_ns, (bytes([k]) * 21).hex()) for k in range(5)]
    assert runs[0].summary.ledger_hash == runs[1].summary.ledger_hash


def of_idle_lines(scenario: str) -> str:
    """The scenario with lines that measure the silence instead of the modems."""
    return scenario.replace("chunk_bytes = 3", "chunk_bytes = 100\nidle_bytes = 3").replace(
        "baud_bps = 57_600 }", "baud_bps = 57_600, idle_bytes = 0 }")


def test_a_line_that_delivers_when_idle_makes_the_same_packets_at_the_same_instants(pair, tmp_path):
    def on_air(text: str, name: str) -> list[tuple[int, int]]:
        pair.write_text(text, encoding="utf-8")
        folder = run(load(pair), host="inline", out=tmp_path / name, report=False).folder
        return [(row["offered_ns"], row["size_bytes"]) for row in pq.read_table(folder / "ledger.parquet").to_pylist()
                if row["medium"] == "air"]

    (pair.parent / "talker.py").write_text(TALKER.replace("* 21", "* 121"), encoding="utf-8")      # 100 and 21
    chunks, idle = on_air(SCENARIO, "chunks"), on_air(of_idle_lines(SCENARIO), "idle")

    # the byte that fills the packet is the first of three in its chunk
    filled_late_ns = ceil(102 * 10 * 10**9 / 57_600) - ceil(100 * 10 * 10**9 / 57_600)
    assert [size for _, size in idle] == [100, 21] * 5
    assert [(offered_ns + filled_late_ns * (size == 100), size) for offered_ns, size in idle] == chunks


def test_on_lines_that_deliver_when_idle_a_message_is_later_by_the_silence_of_the_second(pair, tmp_path):
    pair.write_text(of_idle_lines(SCENARIO), encoding="utf-8")
    runs = [run(load(pair), host=host, out=tmp_path / host, report=False) for host in ("inline", "process")]

    line_ns, silence_ns = ceil(21 * 10 * 10**9 / 57_600), ceil(3 * 10 * 10**9 / 57_600)
    way_ns = line_ns + silence_ns + PRESETS["xbee_802154"].airtime_ns(21) + line_ns + silence_ns
    heard = [(event.time_ns, event.detail) for event in load_run(runs[0].folder).events if event.node == "ground"]
    assert heard == [(k * 100 * MS + way_ns, (bytes([k]) * 21).hex()) for k in range(5)]
    assert runs[0].summary.ledger_hash == runs[1].summary.ledger_hash


def test_impairments_of_the_radio_lose_whole_packets(pair, tmp_path):
    lossy = SCENARIO + '[[impairments]]\non = "air: vehicle_modem -> ground_modem"\nkind = "scripted_loss"\n' \
                       "lose_frames = [1, 3]\n"
    pair.write_text(lossy, encoding="utf-8")

    result = run(load(pair), host="inline", out=tmp_path / "run", report=False)

    assert [data[:2] for _, data in writes(result)] == ["00", "02", "04"]


FIRST = 'serial = "vehicle_uart", radio = "air", baud_bps = 57_600'


@pytest.mark.parametrize(("old", "new", "says"), [
    (FIRST, FIRST.replace("57_600", "9_600"), "9600 bit/s and 10 bits a byte, but vehicle_uart has 57600"),
    (FIRST, FIRST.replace("vehicle_uart", "ground_uart"), "expected a serial_line that it is on; there are vehicle"),
    (FIRST, FIRST + ", packet_bytes = 101", "packets of 101 bytes, but air carries 100"),
    ("chunk_bytes = 3", "chunk_bytes = 4", "media.vehicle_uart.chunk_bytes=4: expected 1 to 3"),
    ("chunk_bytes = 3", "chunk_bytes = 100\nidle_bytes = 3", "and idle_bytes = 0 in agents.vehicle_modem.parameters; "
                                                             "found 100 and 3")])
def test_a_modem_that_does_not_fit_is_refused_before_the_start(pair, old, new, says):
    assert old in SCENARIO
    pair.write_text(SCENARIO.replace(old, new), encoding="utf-8")

    with pytest.raises(ScenarioError, match=says):
        load(pair)

"""Telemetry logs of a run, opened with pymavlink's mavutil and mavlogdump.py; and read back by ours."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil

import marconet
from firmware_sim.mavlink.tlog import BadLog, read_tlog
from netem.records.ledger_file import read_ledger

PROGRAM = '''
from firmware_sim.mavlink.dialect import layout_of, message, pack
from firmware_sim.mavlink.framing import build

class Vehicle:
    def __init__(self, board):
        self.board, self.k = board, 0
        self.port = board.port("radio", lambda data: None, listen_only=True)
        self.system = int(board.name[1:])
        board.every(10_000_000, self.say, offset_ns=1_000_000 * self.system)

    def frame(self, name, **fields):
        self.k += 1
        return build(layout_of(name), pack(message(name, **fields)), self.k % 256, self.system, 1)

    def say(self):
        data = self.frame("HEARTBEAT", type=2, autopilot=3) + self.frame("ATTITUDE", roll=0.01 * self.k)
        self.port.send(data)

class Silent:
    def __init__(self, board):
        board.every(50_000_000, lambda: port.send(b"no frame of MAVLink"))
        port = board.port("radio", listen_only=True)
'''
TABLES: dict[str, Any] = {
    "seed": 5, "length_s": 0.5,
    "agents": {"v1": {"program": "vehicle:Vehicle"}, "v2": {"program": "vehicle:Vehicle"},
               "v3": {"program": "vehicle:Silent"}},
    "impairments": [{"on": "radio: v1 -> v2", "kind": "bernoulli_loss", "loss_ratio": 0.4},
                    {"on": "radio: v1 -> v3", "kind": "delay", "delay_ms": 16, "jitter_ms": 15,
                     "distribution": "uniform"}]}
RADIO = {"radio": {"kind": "broadcast_radio", "preset": "ideal", "bit_rate_bps": 1_000_000}}
SERIAL = {"radio": {"kind": "serial_line", "baud_bps": 921_600, "chunk_bytes": 7}}


def logged(path: Path) -> list[tuple[int, str, int, int]]:
    """Return (time in us, message, system, sequence number) of each frame, by pymavlink."""
    connection = mavutil.mavlink_connection(str(path), dialect="common")
    found = []
    while (message := connection.recv_match()) is not None:
        found.append((round(message._timestamp * 1e6), message.get_type(), message.get_srcSystem(), message.get_seq()))
    connection.close()
    return found


def run(folder: Path, **changes: Any) -> Path:
    (folder / "vehicle.py").write_text(PROGRAM)
    scenario = marconet.Scenario("flight", folder=folder, **{**TABLES, "media": RADIO, "records": {"tlog": {}},
                                                             **changes})
    return marconet.run(scenario, host="inline", out=folder / "run").folder


def test_a_vehicle_has_a_log_of_what_it_sent_and_each_receiver_one_of_what_reached_it(tmp_path: Path) -> None:
    folder = run(tmp_path)

    assert sorted(path.name for path in folder.glob("*.tlog")) == [
        "radio.v1.heard.tlog", "radio.v1.sent.tlog", "radio.v2.heard.tlog", "radio.v2.sent.tlog", "radio.v3.heard.tlog"]
    sent, heard = logged(folder / "radio.v1.sent.tlog"), logged(folder / "radio.v2.heard.tlog")
    assert sent == [(1_000 + 10_000 * (k // 2), ("HEARTBEAT", "ATTITUDE")[k % 2], 1, k + 1) for k in range(100)]
    rows = [row for row in read_ledger(folder / "ledger.parquet").to_pylist()
            if (row["sender"], row["receiver"], row["fate"]) == ("v1", "v2", "delivered")]
    assert 10 < len(rows) < 45
    assert heard == [(row["delivered_ns"] // 1000, name, 1, 2 * row["number"] + k + 1)
                     for row in rows for k, name in enumerate(("HEARTBEAT", "ATTITUDE"))]


def test_what_overtook_is_logged_in_the_order_of_arrival(tmp_path: Path) -> None:
    from_1 = [entry for entry in logged(run(tmp_path) / "radio.v3.heard.tlog") if entry[2] == 1]

    assert [entry[0] for entry in from_1] == sorted(entry[0] for entry in from_1)
    assert [entry[3] for entry in from_1] != sorted(entry[3] for entry in from_1)


def test_frames_in_pieces_are_put_together_again(tmp_path: Path) -> None:
    two = {name: TABLES["agents"][name] for name in ("v1", "v2")}

    folder = run(tmp_path, agents=two, media=SERIAL, impairments=[])

    sent, heard = logged(folder / "radio.v1.sent.tlog"), logged(folder / "radio.v2.heard.tlog")
    assert [entry[1:] for entry in sent] == [(("HEARTBEAT", "ATTITUDE")[k % 2], 1, k + 1) for k in range(100)]
    assert [entry[1:] for entry in heard] == [entry[1:] for entry in sent]


def test_mavlogdump_prints_it(tmp_path: Path) -> None:
    folder = run(tmp_path)
    tool = Path(sys.executable).with_name("mavlogdump.py")

    done = subprocess.run([sys.executable, str(tool), "--types", "ATTITUDE", str(folder / "radio.v2.sent.tlog")],
                          capture_output=True, text=True, check=True, env={"TZ": "UTC", "MAVLINK20": "1"})

    lines = done.stdout.splitlines()
    assert len(lines) == 50
    assert lines[0].startswith("1970-01-01 00:00:00.00: ATTITUDE {")


def test_our_reader_reads_what_pymavlink_reads(tmp_path: Path) -> None:
    path = run(tmp_path) / "radio.v2.heard.tlog"

    assert [(each.time_ns // 1000, each.system, each.data[4]) for each in read_tlog(path)] == [
        (time_us, system, sequence) for time_us, _, system, sequence in logged(path)]


@pytest.mark.parametrize("damage", ["cut", "foreign", "time"])
def test_a_damaged_log_is_an_error_of_one_line(tmp_path: Path, damage: str) -> None:
    good = (run(tmp_path) / "radio.v1.sent.tlog").read_bytes()
    path = tmp_path / "bad.tlog"
    path.write_bytes({"cut": good[:-1], "foreign": b"(0.1) can0 123#", "time": b"\xff" * 8 + good[8:]}[damage])

    with pytest.raises(BadLog, match=r"bad\.tlog: behind frame \d+, at byte \d+: .*`mavlogdump\.py`") as error:
        list(read_tlog(path))
    assert "\n" not in str(error.value)


def test_a_bus_is_refused_before_the_run(tmp_path: Path) -> None:
    media = {**RADIO, "bus": {"kind": "can", "bit_rate_bps": 500_000}}

    with pytest.raises(marconet.ScenarioError) as error:
        run(tmp_path, media=media, records={"tlog": {"media": ["bus", "rodio"]}})

    assert [line.partition(": ")[2] for line in error.value.problems] == [
        "records.tlog: media=bus: bus is a CAN bus, which carries no MAVLink; name one of radio"]

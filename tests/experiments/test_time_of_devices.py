"""Clocks of devices outside: a device with a known clock over MAVLink TIMESYNC, asked by a robot and by the gateway."""

from __future__ import annotations

import socket
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from experiments.judge.round_trips import round_trips
from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import load
from experiments.show.report.build import write_report
from firmware_sim.mavlink.dialect import layout_of, message, pack, unpack
from firmware_sim.mavlink.framing import FrameReader, build
from firmware_sim.mavlink.timesync import Timesync
from netem.gateways.time_watch import Asker

ASKS = """
from firmware_sim.mavlink.timesync import Timesync


class Asks:
    def __init__(self, board):
        self.board, self.timesync, self.token = board, Timesync(), 0
        self.port = board.port("line", self.hear)
        board.every(20_000_000, self.ask, offset_ns=10_000_000)

    def ask(self):
        self.token += 1
        self.port.send(self.timesync.question(self.token))

    def hear(self, data):
        for token, stamp_ns in self.timesync.read(data):
            if stamp_ns is None:
                self.port.send(answer(token, self.board.now_ns))
            else:
                self.board.count("answers")


def answer(token, stamp_ns):
    from firmware_sim.mavlink.dialect import layout_of, message, pack
    from firmware_sim.mavlink.framing import build
    return build(layout_of("TIMESYNC"), pack(message("TIMESYNC", tc1=stamp_ns, ts1=token)), 0, 1, 1)
"""
SCENARIO = """# A robot asks a device outside for its time, over a line that delays.
seed = 1
length_s = 2.0
[agents.robot]
program = "asks:Asks"
[media.line]
kind = "serial_line"
baud_bps = 921_600
buffer_bytes = 4096
[[impairments]]
on = "line: * -> *"
kind = "delay"
delay_ms = 3
[gateways.device]
medium = "line"
peer = "127.0.0.1:{port}"
timesync = {asks}
"""
OFFSET_NS, RATE, THINKS_S = 40_000_000_000, 1 + 300e-6, 0.002


class Device(threading.Thread):
    """Answers questions with a clock that is ahead and fast, `THINKS_S` after it read the clock; asks itself too."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.05)
        self.port = self.socket.getsockname()[1]
        self.began_ns = time.monotonic_ns()
        self.over = threading.Event()
        self.round_trips_s: list[float] = []

    def clock_ns(self) -> int:
        return OFFSET_NS + round((time.monotonic_ns() - self.began_ns) * RATE)

    def run(self) -> None:
        asked: dict[int, int] = {}
        while not self.over.is_set():
            try:
                data, peer = self.socket.recvfrom(1000)
            except TimeoutError:
                continue
            for frame in FrameReader().read(data):
                fields = unpack(frame.layout, frame.payload)
                if fields["tc1"]:
                    self.round_trips_s.append((time.monotonic_ns() - asked.pop(fields["ts1"])) / 1e9)
                    continue
                stamp_ns = self.clock_ns()
                time.sleep(THINKS_S)
                self.socket.sendto(_timesync(tc1=stamp_ns, ts1=fields["ts1"]), peer)
                token = self.clock_ns()
                asked[token] = time.monotonic_ns()
                self.socket.sendto(_timesync(ts1=token), peer)
        self.socket.close()


def _timesync(**fields: int) -> bytes:
    return build(layout_of("TIMESYNC"), pack(message("TIMESYNC", **fields)), 0, 7, 1)


def run_with(device: Device, folder: Path, asks: bool) -> Path:
    (folder / "asks.py").write_text(ASKS)
    (folder / "asks.toml").write_text(SCENARIO.format(port=device.port, asks=str(asks).lower()))
    device.start()
    try:
        return run(load(folder / "asks.toml"), host="inline", out=folder / "run", report=False, real_time=True).folder
    finally:
        device.over.set()
        device.join(timeout=5.0)


@pytest.mark.parametrize("asks", [False, True])
def test_the_clock_of_a_device_is_found_within_its_bound_and_apart_from_the_emulated_delay(tmp_path, asks) -> None:
    device = Device()
    data = load_run(run_with(device, tmp_path, asks))
    table = data.signals["device"]
    column = dict(zip(table.names, table.values.T, strict=True))
    told = np.flatnonzero(~np.isnan(column["device_offset"]))

    assert {Asker(int(by)) for by in column["asked_by"]} == {
        Asker.INSIDE, Asker.OUTSIDE, *([Asker.GATEWAY] if asks else [])}
    assert told.size > 20
    # The true offset at the last sample is 40 s, minus how long the device's clock was started before the run, which
    # is known to the wall time of the set-up, so only its growth is checked: it is within the sum of the bounds.
    first, last = told[0], told[-1]
    grown_s = column["device_offset"][last] - column["device_offset"][first]
    span_s = (table.time_ns[last] - table.time_ns[first]) / 1e9
    bounds_s = column["device_offset_bound"][last] + column["device_offset_bound"][first]
    assert abs(grown_s - span_s * (RATE - 1)) <= bounds_s + 1e-6
    assert abs(column["device_drift"][last] - 300) <= column["device_drift_bound"][last] * 1.001
    assert np.min(column["device_offset_bound"][told]) < THINKS_S        # half of 2 ms, though the line delays 2 x 3 ms
    if asks:
        assert data.counters["robot"]["answers"] <= np.sum(column["asked_by"] == Asker.INSIDE) + 1


def test_a_round_trip_is_split_into_media_lateness_and_outside(tmp_path: Path) -> None:
    device = Device()
    folder = run_with(device, tmp_path, False)

    inside, outside = round_trips(load_run(folder))
    page = write_report(folder).read_text()

    # A frame of 30 bytes at most, with ten bits a byte; the impairment adds 3 ms each way. The device's question also
    # waits on the line for the answer that it sends before.
    airtime_s = 30 * 10 / 921_600
    assert (inside.asker, outside.asker) == ("inside", "outside")
    assert inside.number >= 20
    for trips, frames in ((inside, 2), (outside, 3)):
        assert 0.006 < trips.median.media_s <= 0.006 + frames * airtime_s
        assert trips.median.late_s >= 0
    assert inside.median.outside_s >= THINKS_S
    assert outside.median.robots_s == 0.0       # its program answers at once
    # The device's own clock sees the emulator's part and the loopback twice, which takes some time and never less.
    assert outside.median.total_s <= np.median(device.round_trips_s) + 0.002
    assert "Round trips of questions about time" in page


def test_bytes_that_are_no_question_are_passed_over() -> None:
    timesync = Timesync()
    question = timesync.question(77)

    assert [(message.token, message.stamp_ns) for message in timesync.read(question)] == [(77, None)]
    for wrong in (b"", b"\xfd", question[:-1], b"\xfd" + bytes(30), question[:-1] + b"?", b"\x6f\x00\x00"):
        assert timesync.read(wrong) == []

"""Two ground stations call one vehicle: the first gets the whole stream, the second is refused with an event."""

from __future__ import annotations

import socket
import threading
import time
from pathlib import Path

import pytest
from pymavlink import mavutil

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import load

QUADROTOR = Path(__file__).parents[1] / "cases" / "mav_two_gcs" / "quad_two.toml"
LENGTH_S = 6.0
SECOND_COMES_S = 2.0

pytestmark = pytest.mark.slow


class Station(threading.Thread):
    """A plain pymavlink client that sends a heartbeat a second and counts what it gets."""

    def __init__(self, port: int, system: int) -> None:
        super().__init__(daemon=True)
        self.link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=system)
        self.messages = 0
        self.stopping = threading.Event()

    def run(self) -> None:
        next_heartbeat_s = time.monotonic()
        while not self.stopping.is_set():
            if time.monotonic() >= next_heartbeat_s:
                self.link.mav.heartbeat_send(6, 8, 0, 0, 0)
                next_heartbeat_s += 1.0
            if self.link.recv_match(blocking=True, timeout=0.2) is not None:
                self.messages += 1


def test_the_first_station_gets_the_whole_stream_and_the_second_is_refused(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    scenario = load(QUADROTOR, duration_s=LENGTH_S, overrides=[f"gateways.ground.listen='127.0.0.1:{port}'"])
    first, second = Station(port, 250), Station(port, 251)
    late = threading.Timer(SECOND_COMES_S, second.start)
    first.start()
    late.start()

    result = run(scenario, host="inline", out=tmp_path / "run", report=False, real_time=True)
    for station in (first, second):
        station.stopping.set()
        station.join(timeout=5.0)
        station.link.close()
    told = [event for event in load_run(result.folder).events if event.kind.startswith("gateway peer")]

    assert first.messages > 0
    assert first.link.mav_loss == 0
    assert second.messages == 0
    assert [event.kind for event in told] == ["gateway peer", "gateway peer refused"]
    assert all(event.wall_clock for event in told)



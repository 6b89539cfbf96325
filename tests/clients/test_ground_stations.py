"""Ground stations that know nothing of marconet fly its quadrotor over UDP, in real time, with their own programs."""

from __future__ import annotations

import json
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from firmware_sim.mavlink.geodesy import Origin

HERE = Path(__file__).parent
MAVPROXY = Path(sys.executable).with_name("mavproxy.py")
REACHED_M = 0.3                 # what the client takes for reached
BESIDE_M = 0.1                  # estimate and truth, and the way between two samples of 50 ms at 1.5 m/s
SIDE_M, HEIGHT_M = 2.0, 1.5

pytestmark = pytest.mark.slow


def flown(data):
    """North, east, height of the truth, in metres: the plant's x is east and its y is north."""
    signals = data.signals["quadrotor"]
    return np.stack([signals.column("y"), signals.column("x"), signals.column("z")], axis=1)


def nearest_m(path, *point):
    return float(np.linalg.norm(path - np.array(point), axis=1).min())


@pytest.mark.skipif(find_spec("mavsdk") is None, reason="needs mavsdk: pip install -e '.[clients]'")
def test_mavsdk_reads_telemetry_arms_takes_off_flies_an_offboard_square_and_lands(flying, start, tmp_path):
    client = start([sys.executable, str(HERE / "fly_a_square_with_mavsdk.py"),
                      f"udpin://127.0.0.1:{flying.client_port}", str(HEIGHT_M), str(SIDE_M)], tmp_path)

    client.until('"what": "landed"', 90.0)
    code = client.end(interrupt=False)
    data = flying.data()
    path = flown(data)

    told = [json.loads(line) for line in client.lines if line.startswith("{")]
    assert [step["what"] for step in told] == ["connected", "healthy", "armed", "in the air", *["corner"] * 4, "landed"]
    assert code == 0
    for north_m, east_m in ((SIDE_M, 0.0), (SIDE_M, SIDE_M), (0.0, SIDE_M), (0.0, 0.0)):
        assert nearest_m(path, north_m, east_m, HEIGHT_M) < REACHED_M + BESIDE_M
    assert path[-1][2] < 0.05
    assert data.signals["quadrotor"].column("armed")[-1] == 0.0
    assert len(data.ledger.only(sender="ground")) > 50     # setpoints, 20 a second


@pytest.mark.skipif(not MAVPROXY.exists(), reason="needs MAVProxy: pip install -e '.[clients]'")
def test_mavproxy_lists_parameters_changes_one_and_uploads_and_runs_a_mission(flying, start, tmp_path):
    corners = [(0.0, 0.0), (SIDE_M, 0.0), (SIDE_M, SIDE_M), (0.0, 0.0)]
    commands = [22, 16, 16, 21]
    rows = [f"{k}\t{int(k == 0)}\t3\t{command}\t0\t0.3\t0\t0\t{north_e7 * 1e-7:.7f}\t{east_e7 * 1e-7:.7f}\t"
            f"{HEIGHT_M if command != 21 else 0}\t1"
            for k, (command, (north_e7, east_e7)) in enumerate(zip(
                commands, (Origin().to_global(*corner) for corner in corners), strict=True))]
    (tmp_path / "mission.txt").write_text("QGC WPL 110\n" + "\n".join(rows) + "\n", encoding="utf-8")
    station = start([sys.executable, str(MAVPROXY), f"--master=udpin:127.0.0.1:{flying.client_port}", "--mav20",
                       "--default-modules=param,wp,arm,mode,cmdlong,misc,link", "--logfile=station.tlog",
                       f"--state-basedir={tmp_path}"], tmp_path)

    station.until("Received [0-9]+ parameters")
    station.type("param set NAV_ACC_RAD 0.25")
    station.type_until("param show NAV_ACC_RAD", "NAV_ACC_RAD +0.25")
    station.type("wp load mission.txt")
    station.until("MISSION_ACK: TYPE_MISSION: ACCEPTED")
    station.type("arm throttle")
    station.until("ARMED")
    station.type("long MISSION_START 0 0")
    station.until("MISSION_START: ACCEPTED")
    station.until("DISARMED", 120.0)
    station.end()
    data = flying.data()
    path = flown(data)

    told = [(event.kind, event.detail) for event in data.events]
    assert ("parameter", "NAV_ACC_RAD = 0.25: set") in told
    assert ("mission", "4 of 4 items: accepted") in told
    assert any("mission done" in detail for _, detail in told)
    for north_m, east_m in corners[1:3]:
        assert nearest_m(path, north_m, east_m, HEIGHT_M) < REACHED_M + BESIDE_M
    assert path[-1][2] < 0.05
    assert np.hypot(*path[-1][:2]) < REACHED_M + BESIDE_M

"""A map and a script call one vehicle, each a program of its own: both get the whole stream and their answers."""

from __future__ import annotations

import json
import socket
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
import tomli_w

from experiments.judge.run_data import RunData, load_run
from experiments.scenario import find
from experiments.scenario.document import read
from tests.clients.conftest import until_begun
from tests.free_port import free_port

HERE = Path(__file__).parent
MAVPROXY = Path(sys.executable).with_name("mavproxy.py")
QUADROTOR = Path(__file__).parents[1] / "cases" / "mav_two_gcs" / "quad_two.toml"
STATION = """
import json, sys, time
from pymavlink import mavutil
kind, address, system, asks = sys.argv[1], sys.argv[2], int(sys.argv[3]), 10
for _ in range(600):
    try:
        link = mavutil.mavlink_connection(f"{kind}:{address}", source_system=system, retries=1)
        break
    except OSError:
        time.sleep(0.1)
spans, kinds, others, asked, mine, lost, last, next_s = {}, {}, set(), 0, 0, 0, None, 0.0
end_s = time.monotonic() + 60.0
while mine < asks and time.monotonic() < end_s:
    if time.monotonic() >= next_s:
        next_s = time.monotonic() + 0.5
        link.mav.heartbeat_send(6, 8, 0, 0, 0)
        if last is not None and asked < asks:
            asked += 1
            link.mav.command_long_send(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
    message = link.recv_match(blocking=True, timeout=0.1)
    if message is None:
        continue
    kinds[message.get_type()] = kinds.get(message.get_type(), 0) + 1
    mine += message.get_type() == "COMMAND_ACK" and message.target_system == system
    if message.get_srcSystem() == 1:
        if hasattr(message, "time_boot_ms"):
            spans.setdefault(message.get_type(), [message.time_boot_ms, 0])[1] = message.time_boot_ms
        lost += 0 if last is None else (message.get_seq() - last - 1) % 256
        last = message.get_seq()
    else:
        others.add(message.get_srcSystem())
print(json.dumps({"kinds": kinds, "spans": spans, "asked": asked, "mine": mine, "lost": lost,
                  "others": sorted(others)}), flush=True)
while time.monotonic() < end_s + 60.0:              # the other may need longer
    link.mav.heartbeat_send(6, 8, 0, 0, 0)
    while link.recv_match(blocking=False) is not None:
        pass
    time.sleep(0.5)
"""

pytestmark = pytest.mark.slow


def flown(start, folder: Path, gateways: dict, *of: tuple[str, int, int], **more) -> tuple[list[dict], RunData]:
    """What each station says of itself, and the records of the run, which ends when both have said it."""
    document, _ = read(QUADROTOR)
    document |= {"length_s": 600.0, "gateways": gateways}
    document["agents"]["quadrotor"].update(more.get("quadrotor", {}))
    document["media"].update(more.get("media", {}))
    if "media" in more:
        del document["media"]["telemetry"]
    scenario = folder / "two_stations.toml"
    scenario.write_text("# Question: does each of two stations get the whole stream?\n" + tomli_w.dumps(document))
    run = start([str(Path(sys.executable).with_name("marconet")), "run", str(scenario), "--real-time", "--no-report",
                 "--out", str(folder / "run")], folder)
    stations = [start([sys.executable, "-c", STATION, kind, f"127.0.0.1:{port}", str(system)], folder)
                for kind, port, system in of]
    told = [json.loads(station.until("kinds", 90.0)) for station in stations]
    for station in stations:
        station.process.kill()
    run.end()
    return told, load_run(folder / "run")


def check(told: list[dict]) -> None:
    """Each station got every message of the streams, every answer, and no gap in the vehicle's sequence numbers."""
    for each in told:
        assert each["lost"] == 0
        assert each["mine"] == each["asked"] == 10
        for stream, hertz in (("ATTITUDE", 5), ("LOCAL_POSITION_NED", 10), ("ATTITUDE_QUATERNION", 10)):
            first_ms, last_ms = each["spans"][stream]
            assert each["kinds"][stream] == round((last_ms - first_ms) * 1e-3 * hertz) + 1


def test_two_peers_of_one_udp_port(start, tmp_path: Path) -> None:
    port = free_port(socket.SOCK_DGRAM)

    told, data = flown(start, tmp_path, {"ground": {"medium": "telemetry", "listen": f"127.0.0.1:{port}"}},
                       ("udpout", port, 250), ("udpout", port, 251))

    check(told)
    speaking = [event for event in data.events if event.kind == "gateway peer"]
    assert len(speaking) == 2
    assert all(event.wall_clock for event in speaking)
    assert data.counters["ground"]["datagrams refused"] == 0
    assert data.counters["quadrotor"]["mavlink frames lost"] == 0


def test_two_clients_of_one_tcp_port(start, tmp_path: Path) -> None:
    port = free_port()

    told, data = flown(start, tmp_path, {"ground": {"medium": "telemetry", "kind": "tcp",
                                                    "listen": f"127.0.0.1:{port}"}},
                       ("tcp", port, 250), ("tcp", port, 251))

    check(told)
    assert data.counters["ground"]["connections"] == 2


def test_two_ports_of_one_autopilot_pass_on_what_the_others_have_to_know(start, tmp_path: Path) -> None:
    first, second = free_port(socket.SOCK_DGRAM), free_port()
    line = {"kind": "serial_line", "baud_bps": 57_600, "buffer_bytes": 4096}

    told, data = flown(
        start, tmp_path, {"map": {"medium": "gcs", "kind": "udp", "listen": f"127.0.0.1:{first}"},
                          "script": {"medium": "companion", "kind": "tcp", "listen": f"127.0.0.1:{second}"}},
        ("udpout", first, 250), ("tcp", second, 251), media={"gcs": line, "companion": line},
        quadrotor={"parameters": {"mavlink": {"ports": ["gcs", "companion"]}}})

    check(told)
    assert [each["kinds"]["COMMAND_ACK"] for each in told] == [each["mine"] for each in told]
    assert [set(each["others"]) <= {wanted} for each, wanted in zip(told, (251, 250), strict=True)] == [True, True]
    assert any(each["others"] for each in told)                             # their heartbeats are passed on
    assert data.counters["quadrotor"]["mavlink frames passed on"] > 10


@pytest.mark.skipif(find_spec("mavsdk") is None or not MAVPROXY.exists(), reason="needs the extra clients")
def test_mavproxy_watches_over_tcp_while_mavsdk_flies_over_udp(start, tmp_path: Path) -> None:
    map_port, script_port = free_port(), free_port(socket.SOCK_DGRAM)
    scenario = tmp_path / "map_and_script.toml"
    scenario.write_text(find("quadrotor_udp").read_text().partition("[media.telemetry]")[0] + f"""
[agents.quadrotor.parameters.mavlink]
ports = ["gcs", "companion"]
[media.gcs]
kind = "serial_line"
baud_bps = 921_600
buffer_bytes = 4096
[media.companion]
kind = "serial_line"
baud_bps = 921_600
buffer_bytes = 4096
[gateways.map]
medium = "gcs"
kind = "tcp"
listen = "127.0.0.1:{map_port}"
[gateways.script]
medium = "companion"
listen = "127.0.0.1:0"
peer = "127.0.0.1:{script_port}"
""")
    run_of = start([str(Path(sys.executable).with_name("marconet")), "run", str(scenario), "--real-time", "--no-report",
                    "--out", str(tmp_path / "run")], tmp_path)
    until_begun(run_of, tmp_path / "run")
    station = start([sys.executable, str(MAVPROXY), f"--master=tcp:127.0.0.1:{map_port}", "--mav20",
                     "--default-modules=param,arm,mode,cmdlong,misc,link", "--logfile=station.tlog",
                     f"--state-basedir={tmp_path}"], tmp_path)
    station.until("Received [0-9]+ parameters")
    pilot = start([sys.executable, str(HERE / "fly_a_square_with_mavsdk.py"), f"udpin://127.0.0.1:{script_port}", "1.5",
                   "2.0"], tmp_path)
    station.until("ARMED")
    pilot.until('"what": "landed"', 90.0)
    station.until("DISARMED")
    station.type_until("param show NAV_ACC_RAD", "NAV_ACC_RAD")
    station.end()
    pilot.end(interrupt=False)
    run_of.end()
    data = load_run(tmp_path / "run")

    assert data.counters["map"]["connections"] == 1
    assert data.counters["quadrotor"]["mavlink frames passed on"] > 10

"""pymavlink as it is, in virtual time: it finds the quadrotor, reads its parameters, takes off, hovers and lands."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.run.runner import run
from experiments.scenario import load

GROUND = '''
import time

from pymavlink import mavutil

from firmware_sim.blocking.here import this_program


def fly(device):
    link = mavutil.mavlink_connection(device, source_system=255)
    last = -1.0

    def wait(kind, accept=lambda message: True, within_s=30.0):
        nonlocal last
        end = time.time() + within_s
        while time.time() < end:
            if time.time() - last >= 1.0:
                link.mav.heartbeat_send(6, 8, 0, 0, 0)
                last = time.time()
            message = link.recv_match(type=kind, blocking=True, timeout=0.5)
            if message is not None and accept(message):
                return message
        raise TimeoutError(f"no {kind}")

    def command(number, *parameters):
        link.mav.command_long_send(1, 1, number, 0, *parameters, *[0] * (7 - len(parameters)))
        assert wait("COMMAND_ACK", lambda ack: ack.command == number).result == 0

    wait("HEARTBEAT")
    link.mav.param_request_list_send(1, 1)
    found = {}
    while len(found) < (message := wait("PARAM_VALUE")).param_count - (message.param_id not in found):
        found[message.param_id] = message.param_value
    this_program().board.count("parameters", len(found) + (message.param_id not in found))
    command(400, 1)
    command(22, 0, 0, 0, *[float("nan")] * 4)
    wait("LOCAL_POSITION_NED", lambda at: at.z < -0.9)
    this_program().board.count("flew")
    hover_until = time.monotonic() + 10.0
    wait("HEARTBEAT", lambda message: time.monotonic() > hover_until)
    command(21)
    wait("EXTENDED_SYS_STATE", lambda state: state.landed_state == 1)
    this_program().board.count("landed")
'''
SCENARIO = '''
# A quadrotor and a ground station in pymavlink.
# Question: does an unmodified ground station fly it in virtual time?
seed = 11
length_s = {length_s}
sample_period_ms = 50

[agents.quadrotor]
program = "firmware_sim.mavlink.mavlink_autopilot:MavlinkAutopilot"
plant = {{ fmu = "quadrotor", preset = "hummingbird" }}
media = ["mocap", "telemetry"]

[agents.ground]
program = "ground:fly"
parameters = {{ device = "{device}" }}
media = ["telemetry"]
sockets = {{ telemetry = "bare" }}

[media.mocap]
kind = "sensing"
exposure_period_ms = 10
latency_ms = 10
bodies = {{ quadrotor = ["x", "y", "z", "heading"] }}
every_exposure_to = ["quadrotor"]
fixed_cameras = ["quadrotor"]

[media.telemetry]
kind = "serial_line"
baud_bps = 921_600
buffer_bytes = 4096

[expect]
"count.ground.parameters" = {{ min = 32, max = 32 }}
"count.ground.flew" = {{ min = 1, max = 1 }}
"count.ground.landed" = {{ min = 1, max = 1 }}
"quadrotor.z.max" = {{ min = 0.9, max = 1.5 }}
"telemetry.frames_not_delivered" = {{ max = 1 }}
'''


def scenario(folder: Path, device: str, length_s: float = 20.0):
    (folder / "ground.py").write_text(GROUND)
    (folder / "quad.toml").write_text(SCENARIO.format(device=device, length_s=length_s))
    return load(folder / "quad.toml")


@pytest.mark.parametrize("device", ["udpout:127.0.0.1:14580",
                                    pytest.param("udpin:0.0.0.0:14550", marks=pytest.mark.slow)])
def test_an_unmodified_ground_station_flies_the_quadrotor_and_repeats_exactly(tmp_path, device):
    made = scenario(tmp_path, device)

    results = [run(made, host=host, out=tmp_path / f"{number}", report=False)
               for number, host in enumerate(("inline", "process"))]

    assert [(verdict.key, verdict.value) for verdict in results[0].summary.verdicts if not verdict.holds] == []
    assert len({result.summary.ledger_hash for result in results}) == 1

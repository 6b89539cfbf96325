"""pymavlink drives the rover in C: through gateways in real time, and in virtual time on the host and on the chip."""

from __future__ import annotations

import json
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import marconet
from experiments.judge.run_data import load_run
from tests.clients.conftest import until_begun
from tests.free_port import free_port

HERE = Path(__file__).parent
ON_CHIP = find_spec("unicorn") is not None
GROUND = (HERE / "drive_rover.py").read_text() + '''

def fly():
    from firmware_sim.blocking.here import this_program

    this_program().board.event("told", json.dumps(drive("udpout:127.0.0.1:14580")))
'''
ROVER = '''
[agents.{name}]
firmware = "mavlink_rover"
target = "{target}"
plant = {{ fmu = "unicycle" }}
media = ["{medium}"]

[media.{medium}]
kind = "serial_line"
baud_bps = 57_600
chunk_bytes = 64
idle_bytes = 3
'''
IN_VIRTUAL_TIME = "# Question: does pymavlink drive it in virtual time?\nseed = 1\nlength_s = 5.0\n" + ROVER + '''
[agents.ground]
program = "ground:fly"
media = ["{medium}"]
sockets = {{ {medium} = "bare" }}

[[impairments]]
kind = "corrupt"
on = "{medium}: * -> *"
bit_error_ratio = 1e-4
'''
IN_REAL_TIME = '''# Question: does pymavlink drive them through gateways?
seed = 1
length_s = 600.0
{rovers}
[gateways.tcp]
medium = "serial"
kind = "tcp"
listen = "127.0.0.1:{port}"

[gateways.pty]
medium = "uart"
kind = "serial"
pty = "device"
'''


def check(told: dict) -> None:
    assert told.pop("east_m") > 0.5
    assert 0.0 < told.pop("speed_mps") < 0.7501         # float32; less if a message came later than CTRL_TIMEOUT
    assert told == {"type": 10, "parameters": {"SPEED_MAX": 0.5, "TURN_MAX": 1.0, "CTRL_TIMEOUT": 0.5}, "speed": 0.75,
                    "results": [0, 0, 3, 0], "armed": 128, "ping": 9}


@pytest.mark.slow
def test_through_gateways_in_real_time(start, tmp_path: Path) -> None:
    port, scenario = free_port(), tmp_path / "rovers.toml"
    scenario.write_text(IN_REAL_TIME.format(
        port=port, rovers=ROVER.format(name="rover", medium="serial", target="host")
        + ROVER.format(name="other", medium="uart", target="cortex_m4" if ON_CHIP else "host")))
    run = start([str(Path(sys.executable).with_name("marconet")), "run", str(scenario), "--real-time", "--no-report",
                 "--host", "inline", "--out", str(tmp_path / "run")], tmp_path)
    until_begun(run, tmp_path / "run")
    stations = [start([sys.executable, str(HERE / "drive_rover.py"), device], tmp_path)
                for device in (f"tcp:127.0.0.1:{port}", str(tmp_path / "device"))]
    told = [json.loads(station.until('"ping"', 90.0)) for station in stations]
    run.end()
    counters = load_run(tmp_path / "run").counters

    for each in told:
        check(each)
    assert [counters[rover]["parse errors"] for rover in ("rover", "other")] == [0, 0]
    assert counters["tcp"]["connections"] == counters["pty"]["connections"] == 1


@pytest.mark.skipif(not ON_CHIP, reason="needs the extra cortex-m")
def test_in_virtual_time_with_one_ledger_on_the_host_and_on_the_chip(tmp_path: Path) -> None:
    (tmp_path / "ground.py").write_text(GROUND)
    (tmp_path / "rover.toml").write_text(IN_VIRTUAL_TIME.format(name="rover", medium="serial", target="host"))

    runs = [marconet.run(marconet.load(tmp_path / "rover.toml", set={"agents.rover.target": target}), host="inline",
                         out=tmp_path / target) for target in ("host", "cortex_m4")]

    for run in runs:
        check(json.loads(run.events.filter(run.events["kind"] == "told")["detail"][0]))
    assert runs[0].ledger_hash == runs[1].ledger_hash
    assert runs[0].counters["rover"].items() <= runs[1].counters["rover"].items()      # it counts instructions too
    assert runs[0].counters["rover"]["parse errors"] > 0

"""CAN stacks that know nothing of marconet, each a program of its own, speak over an emulated bus in real time."""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from experiments.judge.run_data import RunData, load_run
from tests.clients.conftest import Program, until_begun

GROUP = "239.74.163.2"
ISOTP = Path(__file__).parents[1] / "cases" / "isotp_two_nodes"
LISTENER = """
class Listener:
    def __init__(self, board):
        board.port("can0", lambda frame: board.count("heard"), listen_only=True)
"""
BENCH = """# Two programs outside share an emulated bus: one comes by multicast, one by a serial adapter.
# Question: do they hear each other?
seed = 1
length_s = 60.0
[agents.listener]
program = "listener:Listener"
[media.can0]
kind = "can"
bit_rate_bps = 125_000
[gateways.near]
kind = "can"
medium = "can0"
interface = "udp_multicast"
channel = "{group}"
options = {{ port = {port} }}
[gateways.far]
kind = "can"
medium = "can0"
interface = "slcan"
channel = "{tty}"
options = {{ sleep_after_open = 0.0 }}
"""
NODE = """
import sys, time, canopen
from canopen.objectdictionary import UNSIGNED32, ODVariable, ObjectDictionary
speed = ODVariable("Speed", 0x2000, 0)
speed.data_type, speed.access_type = UNSIGNED32, "rw"
dictionary = ObjectDictionary()
dictionary.add_object(speed)
network = canopen.Network()
network.connect(interface="slcan", channel=sys.argv[1], sleep_after_open=0.0)
node = canopen.LocalNode(5, dictionary)
network.add_node(node)
node.sdo[0x2000].raw = 17
print("ready", flush=True)
time.sleep(60)
"""
MASTER = """
import json, sys, time, canopen
from canopen.objectdictionary import UNSIGNED32, ODVariable, ObjectDictionary
speed = ODVariable("Speed", 0x2000, 0)
speed.data_type, speed.access_type = UNSIGNED32, "rw"
dictionary = ObjectDictionary()
dictionary.add_object(speed)
network = canopen.Network()
network.connect(interface="udp_multicast", channel=sys.argv[1], port=int(sys.argv[2]), hop_limit=0, fd=False)
node = canopen.RemoteNode(5, dictionary)
network.add_node(node)
node.sdo.RESPONSE_TIMEOUT = 5.0
found, waits = [node.sdo[0x2000].raw], []
for value in range(20):
    began = time.monotonic()
    node.sdo[0x2000].raw = value
    waits.append(time.monotonic() - began)
    found.append(node.sdo[0x2000].raw)
print(json.dumps({"found": found, "waits": waits}), flush=True)
network.disconnect()
"""

pytestmark = pytest.mark.slow


@pytest.fixture
def port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("", 0))
        return int(free.getsockname()[1])


@pytest.fixture
def wire(tmp_path: Path) -> Iterator[tuple[Path, Path]]:
    """Two ends of a serial cable."""
    if shutil.which("socat") is None:
        pytest.skip("needs socat")
    ends = tmp_path / "ttyA", tmp_path / "ttyB"
    with subprocess.Popen(["socat", *(f"pty,link={end},raw,echo=0" for end in ends)]) as cable:
        while not all(end.exists() for end in ends):
            time.sleep(0.01)
        yield ends
        cable.terminate()


def marconet(scenario: Path, start: Callable[[list[str], Path], Program]) -> Program:
    return start([str(Path(sys.executable).with_name("marconet")), "run", str(scenario), "--real-time", "--out",
                  str(scenario.parent / "run"), "--no-report"], scenario.parent)


def ended(run: Program, scenario: Path) -> RunData:
    run.end()
    return load_run(scenario.parent / "run")


@pytest.mark.skipif(find_spec("canopen") is None, reason="needs canopen: pip install -e '.[clients]'")
def test_a_canopen_master_reads_and_writes_a_node_through_the_emulated_bus(start, tmp_path, port, wire):
    (tmp_path / "listener.py").write_text(LISTENER)
    scenario = tmp_path / "bench.toml"
    scenario.write_text(BENCH.format(group=GROUP, port=port, tty=wire[0]))
    node = start([sys.executable, "-c", NODE, str(wire[1])], tmp_path)
    node.until("ready")
    run = marconet(scenario, start)
    until_begun(run, tmp_path / "run")

    master = start([sys.executable, "-c", MASTER, GROUP, str(port)], tmp_path)
    said = json.loads(master.until("found"))
    master.end()
    data = ended(run, scenario)

    assert said["found"] == [17, *range(20)]
    # A request and an answer of 8 bytes have at least 111 bits less one each, at 125 kbit/s.
    assert min(said["waits"]) >= 2 * 110 / 125_000
    assert data.counters["near"]["frames received"] == 41
    assert data.counters["far"]["frames received"] == 41
    assert len(data.ledger.only(receiver="listener")) == 82
    assert data.counters["can0"]["error_frames"] == 0


@pytest.mark.skipif(find_spec("isotp") is None, reason="needs can-isotp: pip install -e '.[clients]'")
def test_a_control_unit_outside_answers_an_iso_tp_tester_inside_the_run(start, tmp_path, port):
    shutil.copy(ISOTP / "ecus.py", tmp_path)
    scenario = tmp_path / "isotp.toml"
    scenario.write_text(f"""# A tester in the run, a control unit outside.
# Question: does a message of 300 bytes go there and back?
seed = 1
length_s = 8.0
[agents.tester]
program = "ecus:tester"
[media.can0]
kind = "can"
bit_rate_bps = 500_000
[gateways.ecu]
kind = "can"
medium = "can0"
interface = "udp_multicast"
channel = "{GROUP}"
options = {{ port = {port} }}
""")
    outside = subprocess.Popen(
        [sys.executable, "-c", f"import ecus; ecus.ecu('udp_multicast', '{GROUP}')"], cwd=tmp_path,
        env={**os.environ, "CAN_CONFIG": json.dumps({"port": port, "hop_limit": 0})})
    try:
        time.sleep(1.0)
        run = marconet(scenario, start)
        run.process.wait(60.0)
        data = ended(run, scenario)
    finally:
        outside.kill()
        outside.wait()

    assert "sent 300, got 300 bytes, equal True" in (tmp_path / "run" / "logs" / "tester.log").read_text()
    assert data.counters["ecu"]["frames received"] >= 43        # 300 bytes: 1 first and 42 consecutive frames
    assert data.counters["ecu"]["no CAN frames"] == 0

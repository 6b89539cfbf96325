"""Random bytes on every port of every kind of medium: they are counted and harm nobody."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from experiments.judge.run_data import load_run
from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario.loader import load
from netem.media.table import MEDIA

PROGRAM = '''
from netem.media.packet_network.datagram import Datagram, pack
from netem.media.sensing.sight import LOOK


class Fuzz:
    """Sends random bytes at all of its ports, looks, CAN frames and datagrams among them, and counts what it hears."""

    def __init__(self, board):
        self.board = board
        self.ports = [board.port(name, lambda data, name=name: board.count("heard on " + name))
                      for name in board.ports]

    def run(self):
        rng, next_ns = self.board.rng, 0
        while True:
            yield from self.board.sleep_until(next_ns)
            for port in self.ports:
                size = rng.choice([0, 1, 3, 8, 16, 60, 72, rng.randrange(2_000)])
                can = rng.randrange(0x800).to_bytes(4, "little") + bytes([8, 0, 0, 0]) + rng.randbytes(8)
                datagram = pack(Datagram("*", rng.randbytes(size)))
                port.send(rng.choice([can, LOOK, datagram, rng.randbytes(size), rng.randbytes(size)]))
            next_ns += 1_000_000 + rng.randrange(1_000_000)
'''
SCENARIO = """
# Question: do random bytes harm anybody?
seed = 5
length_s = 0.4

[agents_defaults]
program = "fuzz:Fuzz"

[agents.a]
plant = { fmu = "unicycle" }

[agents.b]

[media.radio]
kind = "broadcast_radio"
preset = "crazyflie_p2p"

[media.bus]
kind = "can"
bit_rate_bps = 1_000_000

[media.uart]
kind = "serial_line"
baud_bps = 921_600

[media.lan]
kind = "packet_network"
rate_bps = 10_000_000

[media.view]
kind = "sensing"
exposure_period_ms = 10
latency_ms = 1
bodies = { a = ["x", "y", "theta"] }
"""


@pytest.mark.parametrize("host", ["inline", "process"])
def test_random_bytes_on_every_port_are_counted_and_crash_nobody(tmp_path: Path, host: HostName) -> None:
    (tmp_path / "fuzz.py").write_text(PROGRAM)
    (tmp_path / "fuzz.toml").write_text(SCENARIO)
    scenario = load(tmp_path / "fuzz.toml")

    data = load_run(run(scenario, host=host, out=tmp_path / "run", report=False).folder)

    malformed = Counter(medium for medium, _, _ in data.ledger.only(fate="malformed").link.values())
    assert {spec.kind for spec in scenario.media.values()} == set(MEDIA)        # a new kind belongs in here too
    assert all(data.counters[node][f"heard on {medium}"] > 20 for node in scenario.agents for medium in scenario.media)
    assert all(malformed[medium] > 20 for medium in ("radio", "bus", "uart", "lan"))
    assert all(data.counters[node]["unreadable frames"] > 100 for node in scenario.agents)     # what is no look
    assert data.length_ns == 400_000_000

"""Two robots on a lossy radio, a CAN bus and a serial line, for tests of what is recorded and played."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import tomli_w

import marconet

PROGRAM: Final = '''
from dataclasses import dataclass

from netem.media.can.frame import CanFrame, pack

class Beacon:
    @dataclass
    class Settings:
        number: int

    def __init__(self, board, settings):
        self.board, self.number, self.k = board, settings.number, 0
        self.ports = {name: board.port(name, lambda data: None, listen_only=True) for name in board.ports}
        board.record("time", "s", lambda: board.now_ns * 1e-9)
        board.every(10_000_000, self.say, offset_ns=1_000_000 * settings.number)

    def say(self):
        self.ports["radio"].send(bytes([self.number, self.k % 256]) * 4)
        self.ports["bus"].send(pack(CanFrame(self.number, bytes([self.k % 256] * (self.k % 9)))))
        self.ports["bus"].send(pack(CanFrame(0x1ABCDE0 + self.number, b"later", extended=True)))
        if "line" in self.ports:
            self.ports["line"].send(b"" if self.k % 5 == 4 else b"serial")
        self.k += 1
'''
EVERY_LOG: Final = ["candump", "blf", "asc", "trc", "csv"]
TABLES: Final[dict[str, Any]] = {
    "seed": 1, "length_s": 0.2, "agents_defaults": {"program": "beacon:Beacon"},
    "agents": {"a": {"parameters": {"number": 1}, "media": ["radio", "bus", "line"]},
               "b": {"parameters": {"number": 2}, "media": ["radio", "bus", "line"]},
               "c": {"parameters": {"number": 3}, "media": ["radio", "bus"]}},
    "media": {"radio": {"kind": "broadcast_radio", "preset": "crazyflie_p2p"},
              "bus": {"kind": "can", "bit_rate_bps": 500_000, "log": EVERY_LOG},
              "line": {"kind": "serial_line", "baud_bps": 115_200}},
    "impairments": [{"on": "radio: a -> b", "kind": "bernoulli_loss", "loss_ratio": 0.5},
                    {"on": "radio: a -> c", "kind": "duplicate", "duplicate_ratio": 0.5, "extra_delay_ms": 3},
                    {"on": "radio: b -> a", "kind": "delay", "delay_ms": 30}]}


def team(folder: Path, **changes: Any) -> marconet.Scenario:
    (folder / "beacon.py").write_text(PROGRAM)
    return marconet.Scenario("team", folder=folder, **{**TABLES, **changes})


def written_team(folder: Path, **changes: Any) -> Path:
    """The same as a file of a scenario."""
    (folder / "beacon.py").write_text(PROGRAM)
    path = folder / "team.toml"
    path.write_text("# Question: what is recorded?\n" + tomli_w.dumps({**TABLES, **changes}))
    return path

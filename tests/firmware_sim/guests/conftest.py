"""Runs with guests: the autopilot is another program in a process of its own."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import marconet
from tests.free_port import free_port

HERE = Path(__file__).parent
PATIENCE_S = 60.0
GROUND = """
class Ground:
    \"\"\"Hears telemetry, and speaks to the vehicle every 0.5 s.\"\"\"

    def __init__(self, board):
        self.board, self.port = board, board.port("air", lambda data: board.count("heard"))
        board.count("heard", 0)

    def run(self):
        for k in range(1, 1000):
            yield from self.board.sleep_until(k * 500_000_000)
            self.port.send(b"hello vehicle")
"""


@dataclass
class Flight:
    run: marconet.Run
    guests: list[dict[str, Any]]

    def final(self, signal: str, node: str = "v1") -> float:
        return float(self.run.signals[node][signal][-1])


@pytest.fixture
def fly(tmp_path: Path) -> Iterator[Callable[..., Flight]]:
    """Return a function that runs vehicles `v1`, `v2`, ... with guests of a kind, each with its own process."""
    (tmp_path / "ground.py").write_text(GROUND)
    started: list[subprocess.Popen[str]] = []

    def run(kind: str, program: str, what: str = "", *, vehicles: int = 1, length_s: float = 5.0, host: str = "process",
            **parameters: Any) -> Flight:
        agents: dict[str, Any] = {"ground": {"program": "ground:Ground"}}
        guests = []
        for number in range(1, vehicles + 1):
            port = free_port(socket.SOCK_STREAM if kind == "px4" else socket.SOCK_DGRAM)
            telemetry = free_port(socket.SOCK_DGRAM)
            agents[f"v{number}"] = {
                "program": program, "plant": {"fmu": "quadrotor", "preset": "hummingbird"},
                "parameters": {"listen": f"127.0.0.1:{port}", "telemetry": {"listen": f"127.0.0.1:{telemetry}"},
                               **parameters}}
            guests.append(subprocess.Popen(
                [sys.executable, str(HERE / f"{kind}_client.py"), str(port), str(telemetry), str(0.5 + number),
                 *([what] if what else [])], stdout=subprocess.PIPE, text=True))
        started.extend(guests)
        scenario = marconet.Scenario(
            "guests", folder=tmp_path, length_s=length_s, seed=3, sample_period_ms=10, agents=agents, node_timeout_s=40,
            media={"air": {"kind": "broadcast_radio", "preset": "xbee_802154", "decode": "local",
                           "topology": {"kind": "fixed", "links": ["* -> *"]}}})
        out = tmp_path / f"run{len(started)}"
        found = marconet.run(scenario, host=host, out=out)
        return Flight(found, [json.loads(guest.communicate(timeout=PATIENCE_S)[0].splitlines()[-1])
                              for guest in guests])

    yield run
    for guest in started:
        guest.kill()
        guest.communicate()

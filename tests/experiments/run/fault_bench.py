"""A run of three robots with faults, as the tests of faults need it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import load
from netem.records.events import hash_of_events
from netem.records.ledger_file import read_ledger, read_metadata

MS = 1_000_000
HOSTS = ["inline", "process"]
PROGRAM = '''
import os
from dataclasses import dataclass

class Beacon:
    @dataclass
    class Settings:
        offset_ns: int
        v: float | None = None
        omega: float = 0.3

    def __init__(self, board, settings):
        print(f"begins at {board.now_ns}")
        self.port = board.port("radio", self.hear, listen_only=True)
        self.board, self.sent, self.heard_ns = board, 0, []
        board.record("sent", "1", lambda: self.sent)
        board.record("draw", "1", lambda draw=board.rng.random(): draw)
        board.record("local", "s", lambda: board.now_ns * 1e-9)
        board.every(10_000_000, self.say, offset_ns=settings.offset_ns)
        if settings.v is not None:
            board.actuate("v_cmd", settings.v)
            board.actuate("omega_cmd", settings.omega)

    def hear(self, frame):
        self.board.count("heard")
        self.board.event("heard", frame.hex())

    def say(self):
        self.sent += 1
        self.port.send(self.sent.to_bytes(8, "little"))
'''
WATCH = '''
class Watch:
    def __init__(self, board):
        self.board, self.port = board, board.port("view", self.see, listen_only=True)

    def see(self, data):
        self.board.event("saw", data.hex())
'''
TALK = '''
from dataclasses import dataclass
from netem.media.can.frame import CanFrame, pack

class Talk:
    @dataclass
    class Settings:
        can_id: int
        offset_ns: int

    def __init__(self, board, settings):
        self.settings, self.port = settings, board.port("can", listen_only=True)
        board.every(1_000_000, self.say, offset_ns=settings.offset_ns)

    def say(self):
        self.port.send(pack(CanFrame(self.settings.can_id, bytes(8))))
'''
SCENARIO = '''
# Question: what do faults cost?
seed = 7
length_s = 1.0
sample_period_ms = 10
[agents_defaults]
program = "beacon:Beacon"
[agents]
a = { parameters = { offset_ms = 0 } }
b = { parameters = { offset_ms = 3, v = 0.5 }, plant = { fmu = "unicycle" } }
c = { parameters = { offset_ms = 6 } }
[media]
radio = { kind = "broadcast_radio", preset = "crazyflie_p2p", receive_latency_us = 300 }
'''


class Ran:
    """A run of `SCENARIO` with these lines after it."""

    def __init__(self, folder: Path, host: Any, faults: str, scenario: str = SCENARIO) -> None:
        folder.mkdir(exist_ok=True)
        for module, program in (("beacon", PROGRAM), ("watch", WATCH), ("talk", TALK)):
            (folder / f"{module}.py").write_text(program)
        (folder / "faults.toml").write_text(scenario + faults)
        self.out = folder / "run"
        run(load(folder / "faults.toml"), host=host, out=self.out, report=False)        # checks conservation
        self.data = load_run(self.out)
        self.rows: list[dict[str, Any]] = read_ledger(self.out / "ledger.parquet").to_pylist()
        self.hash = read_metadata(self.out / "ledger.parquet")["hash"], hash_of_events(self.data.events)

    def samples(self, node: str, *names: str) -> np.ndarray[Any, Any]:
        table = self.data.signals[node]
        return np.column_stack([table.time_ns / MS, *(table.values[:, table.names.index(name)] for name in names)])

    def heard_ms(self, node: str) -> list[float]:
        return [event.time_ns / MS for event in self.data.events if (event.node, event.kind) == (node, "heard")]

    def copies(self, **of: str) -> list[dict[str, Any]]:
        return [row for row in self.rows if all(row[key] == value for key, value in of.items())]

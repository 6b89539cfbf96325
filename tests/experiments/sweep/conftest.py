"""A scenario of two beacons over a lossy radio; by its keys a program stops the process, raises, or takes its time."""

from __future__ import annotations

from pathlib import Path

import pytest

PROGRAM = '''
import os
import signal
import time
from dataclasses import dataclass


class Beacon:
    COUNTERS = ("heard",)

    @dataclass
    class Settings:
        ends: str = ""
        wall_ms: float = 0.0

    def __init__(self, board, settings):
        self.board, self.settings = board, settings
        self.radio = board.port("radio", lambda frame: board.count("heard"), listen_only=True)
        board.record("time", "s", lambda: board.now_ns * 1e-9)
        board.every(10_000_000, self.say, offset_ns=0 if board.name == "a" else 5_000_000)

    def say(self):
        if self.settings.ends == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if self.settings.ends == "raises":
            raise RuntimeError("no fuel")
        until = time.monotonic() + self.settings.wall_ms * 1e-3
        while time.monotonic() < until:
            pass
        self.radio.send(bytes(8))
'''
SCENARIO = '''
# Question: how many beacons are heard?
seed = 7
length_s = 0.5
[agents_defaults]
program = "beacon:Beacon"
[agents]
a = {}
b = { parameters = { ends = "", wall_ms = 0.0 } }
[media]
radio = { kind = "broadcast_radio", preset = "crazyflie_p2p" }
[[impairments]]
on = "radio: * -> *"
kind = "gilbert_elliott"
loss_ratio = 0.3
mean_burst_frames = 1.0
[expect]
delivery_ratio = { min = 0.5 }
"count.a.heard" = { min = 20 }
'''


@pytest.fixture
def beacons(tmp_path: Path) -> Path:
    folder = tmp_path / "here"
    folder.mkdir()
    (folder / "beacon.py").write_text(PROGRAM)
    (folder / "beacons.toml").write_text(SCENARIO)
    return folder / "beacons.toml"

"""Two programs that beacon every 100 ms, and one that watches: it splits if it misses `a` in round 12 and `b` in 31."""

from __future__ import annotations

from pathlib import Path

import pytest

PROGRAM = '''
from dataclasses import dataclass

PERIOD_NS = 100_000_000


class Beacon:
    def __init__(self, board):
        self.board = board
        self.radio = board.port("radio", listen_only=True)
        board.every(PERIOD_NS, self.say, offset_ns=10_000_000 if board.name == "a" else 20_000_000)

    def say(self):
        self.radio.send(self.board.name.encode())


class Watch:
    @dataclass
    class Settings:
        raises: bool = False
        bias: float = 0.0

    def __init__(self, board, settings):
        self.board, self.settings = board, settings
        self.heard, self.missed, self.round = set(), set(), 0
        board.port("radio", self.hear, listen_only=True)
        board.every(PERIOD_NS, self.close, offset_ns=40_000_000)
        for counter in ("split", "heard"):
            board.count(counter, 0)
        board.record("missed", "1", lambda: float(len(self.missed)))
        board.record("bowl", "1", lambda: (settings.bias - 0.3) ** 2)

    def hear(self, frame):
        self.board.count("heard")
        self.heard.add(frame.decode(errors="replace"))

    def close(self):
        self.missed |= {(name, self.round) for name in "ab" if name not in self.heard}
        if {("a", 12), ("b", 31)} <= self.missed and self.round == 31:
            self.board.count("split")
            if self.settings.raises:
                raise RuntimeError(f"split at {self.board.now_ns}")
        self.heard, self.round = set(), self.round + 1
'''
SCENARIO = '''
# Two beacons and their watch.
# Question: does the watch split?
seed = 4
length_s = 4.5
[agents]
a = { program = "watch:Beacon" }
b = { program = "watch:Beacon" }
c = { program = "watch:Watch", parameters = { raises = false, bias = 0.0 } }
[media]
radio = { kind = "broadcast_radio", preset = "crazyflie_p2p" }
[expect]
"count.c.heard" = { min = 10 }
"count.c.split" = { max = 0 }
'''
PAUSES = '''
[[faults]]
kind = "pause"
on = "[ab]"
at_s = 0.0
lasts_s = 0.07
every_s = 0.2
times = 20
name = "even"
'''


@pytest.fixture
def watched(tmp_path: Path) -> Path:
    folder = tmp_path / "here"
    folder.mkdir()
    (folder / "watch.py").write_text(PROGRAM)
    (folder / "watched.toml").write_text(SCENARIO)
    return folder / "watched.toml"


@pytest.fixture
def forty_faults(watched: Path) -> Path:
    """40 occurrences of pauses, 20 of each node; of those, a's of round 12 and b's of round 31 split the watch."""
    odd = PAUSES.replace("[ab]", "b").replace("at_s = 0.0", "at_s = 0.1").replace("even", "odd")
    watched.write_text(watched.read_text() + PAUSES.replace("[ab]", "a") + odd)
    return watched

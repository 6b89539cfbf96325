"""A small valid scenario and the robots it needs, in a folder of their own; tests change a word or two of it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

ROBOTS = '''
from dataclasses import dataclass
from pathlib import Path


class Talker:
    """A program as far as the loader looks at it."""

    @dataclass
    class Settings:
        slot_ns: int = 1_000_000
        gain: float = 1.0
        log: Path | None = None

    def __init__(self, board, settings):
        self.board = board


class Strict(Talker):
    @dataclass
    class Settings:
        gain: float
        anything: object = None

    @staticmethod
    def check(scenario, own):
        if scenario.team.get("impossible"):
            yield "team.impossible=true: this cannot work; leave it out"
            yield "team.impossible=true: really not"


class Boardless:
    pass


not_a_class = 3
'''

VALID = """\
# A few robots.
# Question: does the loader
#   read this?
seed = 7
length_s = 2.5
[team.models.r1]
A = [[-1.0, 2.0], [0.0, -3.0]]
K = [[4.0]]
[agents_defaults]
program = "robots_of_the_tests:Talker"
clock = { drift_ppm = 20.0 }
[agents.r1]
parameters = { slot_ms = 1.1 }
clock = { offset_us = 5 }
plant = { fmu = "linear_system", parameters_from = "team.models.r1" }
at_m = [0.0, 1.0]
[agents.r2]
media = ["radio"]
[media.radio]
kind = "broadcast_radio"
preset = "crazyflie_p2p"
[media.quiet]
kind = "broadcast_radio"
[[impairments]]
on = "radio: r1 -> r2"
during_s = [0.5, 1.0]
kind = "gilbert_elliott"
loss_ratio = 0.25
mean_burst_frames = 3.0
[[impairments]]
on = "*: * -> *"
kind = "delay"
delay_us = 20
[expect]
frames_lost_on_link = { min = 1 }
"*.y.last_abs" = { max = 1e-3 }
"""

Write = Callable[[str], Path]


@pytest.fixture
def valid() -> str:
    return VALID


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Write]:
    """Writes a scenario beside its robots and gives its path."""
    (tmp_path / "robots_of_the_tests.py").write_text(ROBOTS)
    monkeypatch.setattr(sys, "path", [*sys.path])

    def scenario(text: str) -> Path:
        path = tmp_path / "few.toml"
        path.write_text(text, encoding="utf-8")
        return path

    yield scenario
    sys.modules.pop("robots_of_the_tests", None)

"""The rows `waves-...` of docs/reproduction.md, Delays: computed here, so that the page cannot rot.

`pytest -s tests/agents/waves/test_reproduction.py -k waves-value` prints that row.
"""

from __future__ import annotations

import numpy as np
import pytest

from agents.synchronization.team import read_team
from agents.waves.agent import Agent
from agents.waves.network import Network
from agents.waves.output_loop import OutputLoop
from agents.waves.passivity import violation
from agents.waves.port import WavePort
from agents.waves.team import read_wave_team
from agents.waves.wave_loop import start, wave_loop
from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import find, load
from tests.agents.reproduction_page import documented

SLOTS = (0, 0.1, 1, 5, 10)


class Example:
    """The robots of output_sync_waves; every method gives the text of one row's "ours"."""

    def __init__(self, folder):
        team = read_wave_team(load(find("output_sync_waves")).team)
        self.folder, self.damping, self.port = folder, team.damping, team.port
        self.network = Network(tuple(team.agents), dict.fromkeys(team.edges, 0), team.slot_ns)
        self.x0 = np.concatenate([model.x0[:-1] for model in team.models.values()])

    def late_by(self, slots):
        return self.network.with_delay(round(slots * self.network.slot_ns))

    def held(self, slots, damping=None, own_late=True):
        return OutputLoop(self.late_by(slots), damping or self.damping, own_late).loop.radius

    def radii(self):
        return " ".join(f"{wave_loop(self.late_by(slots), self.port).radius:.4f}" for slots in SLOTS)

    def held_radii(self, own_late):
        return " ".join(f"{self.held(slots, own_late=own_late):.4f}" for slots in SLOTS)

    def limit(self):
        stable, unstable = 8.0, 9.0
        while unstable - stable > 1e-5:
            middle = (stable + unstable) / 2
            stable, unstable = (middle, unstable) if self.held(middle) < 1 else (stable, middle)
        return f"{stable:.3f} slots, {stable * 20:.2f} ms"

    def gain(self):
        stable, unstable = 1.0, 20.0
        while unstable - stable > 1e-5:
            middle = (stable + unstable) / 2
            stable, unstable = (middle, unstable) if self.held(0, middle) < 1 else (stable, middle)
        strong = max(wave_loop(self.late_by(slots), WavePort(100.0, 100.0)).radius for slots in SLOTS)
        return f"{stable:.3f}; {strong:.4f}"

    def values(self):
        loops = [wave_loop(self.late_by(slots), self.port) for slots in SLOTS]
        return " ".join(f"{loop.limit(start(loop, self.x0)):.4f}" for loop in loops)

    def passive(self):
        agents = read_team(load(find("output_sync_delayed")).team).agents
        passive = [each for each in agents if violation(Agent(each.A, each.B, each.C), 1.0) is None]
        return f"{len(passive)} of {len(agents)}"

    def broken(self):
        data = self.ran("broken", 0.2)
        return f"{data.guarantees['passive'].violations[0].from_ns} ns"

    def varying(self):
        kept = [self.ran(name, 20.0, *keys).signals["r1"].column("y")[-1] for name, keys in
                (("cut", ["team.when_silent='zero'"]), ("later", ["team.use_after_s=0.1"]))]
        return f"{kept[0]:.4f}; {kept[1]:.4f}"

    def ran(self, name, length_s, *overrides):
        wanted = load(find("output_sync_waves_broken"), duration_s=length_s, overrides=["expect={}", *overrides])
        return load_run(run(wanted, host="inline", out=self.folder / name, report=False).folder)


ROWS = {
    "waves-radii": Example.radii,
    "waves-held-late": lambda e: e.held_radii(True),
    "waves-held-at-once": lambda e: e.held_radii(False),
    "waves-held-limit": Example.limit,
    "waves-held-gain": Example.gain,
    "waves-value": Example.values,
    "waves-passive": Example.passive,
    "waves-break": Example.broken,
    "waves-varying": Example.varying,
}


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    return Example(tmp_path_factory.mktemp("runs"))


@pytest.mark.parametrize("name", ROWS)
def test_the_page_says_what_the_code_gives(name, example):
    ours = ROWS[name](example)
    print(f"{name}: {ours}")

    assert documented("Delays")[name] == ours


def test_the_page_has_no_row_of_waves_that_is_not_computed():
    assert {name for name in documented("Delays") if name.startswith("waves-")} == set(ROWS)

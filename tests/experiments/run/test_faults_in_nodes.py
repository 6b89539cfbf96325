"""Faults of plants and processors in runs, on both hosts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.run.runner import run
from experiments.scenario.document import read
from experiments.scenario.loader import load_tables
from netem.records.ledger_file import read_metadata
from tests.experiments.run.fault_bench import MS

ROOT = Path(__file__).parents[3]
DOUBLED = """
from dataclasses import dataclass

class Task:
    has_execution_time = True

    @dataclass
    class Settings:
        execution_ns: int

    def __init__(self, board, settings):
        self.board, self.settings, self.port = board, settings, board.port("radio", listen_only=True)

    def run(self):
        release_ns = -(-self.board.now_ns // 10_000_000) * 10_000_000
        while True:
            yield from self.board.sleep_until(release_ns, silent_until_ns=release_ns + self.settings.execution_ns)
            yield from self.board.sleep_until(release_ns + self.board.execution_ns(self.settings.execution_ns))
            self.port.send(b"done")
            release_ns += 10_000_000
"""


@pytest.mark.parametrize(("change", "speed"), [("value = 0.1", 0.1), ("factor = 0.4", 0.2), ("bias = -0.2", 0.3)])
def test_an_input_gets_what_the_fault_says_whatever_the_program_sets(both: Any, change: str, speed: float) -> None:
    ran = both(f'[[faults]]\nkind = "plant_input"\non = "b"\nvariable = "v_cmd"\n{change}\nduring_s = [0.3, 0.5]\n')

    v = ran.samples("b", "v")
    assert set(v[1:30, 1]) == {0.5}
    np.testing.assert_allclose(v[31:50, 1], speed)
    np.testing.assert_allclose(v[51:, 1], 0.5)


@pytest.mark.parametrize("restart", ["", "restart_after_s = 0.05\n"])
def test_a_fault_of_an_input_goes_on_while_the_program_is_dead(both: Any, restart: str) -> None:
    ran = both('[[faults]]\nkind = "plant_input"\non = "b"\nvariable = "v_cmd"\nfactor = 0.4\nduring_s = [0.3, 0.5]\n'
               f'[[faults]]\nkind = "kill"\non = "b"\nat_s = 0.4\n{restart}')

    v = ran.samples("b", "v")
    np.testing.assert_allclose(v[31:50, 1], 0.2)
    np.testing.assert_allclose(v[51:, 1], 0.5)


def test_a_fault_of_an_input_may_begin_while_the_program_is_dead_and_changes_what_it_then_sets(both: Any) -> None:
    ran = both('[[faults]]\nkind = "plant_input"\non = "b"\nvariable = "v_cmd"\nbias = 0.1\nduring_s = [0.3, 0.7]\n'
               '[[faults]]\nkind = "kill"\non = "b"\nat_s = 0.2\nrestart_after_s = 0.3\n'
               'inputs_when_dead = { v_cmd = 0.0 }\n')

    v = ran.samples("b", "v")
    for start, end, speed in ((1, 20, 0.5), (21, 30, 0.0), (31, 50, 0.1), (51, 70, 0.6), (71, 100, 0.5)):
        np.testing.assert_allclose(v[start:end, 1], speed, atol=1e-12)


def test_a_wheel_that_weakens(both: Any) -> None:
    ran = both('[[faults]]\nkind = "plant_parameter"\non = "b"\nvariable = "gain_left"\nfactor = 0.5\nat_s = 0.3\n')

    v, left, right = ran.samples("b", "v", "wheel_left", "wheel_right")[:, 1:].T
    np.testing.assert_allclose(left[31:], 0.5 * left[1])
    np.testing.assert_allclose(right[31:], right[1])
    np.testing.assert_allclose(v[31:], 0.1 * (0.5 * left[1] + right[1]) / 2)       # radius 0.1 m


def test_faults_of_one_input_add_up_in_the_order_in_which_they_began(both: Any) -> None:
    one = '[[faults]]\nkind = "plant_input"\non = "b"\nvariable = "v_cmd"\n'
    ran = both(f"{one}factor = 0.5\nduring_s = [0.2, 0.6]\n{one}bias = 0.1\nduring_s = [0.4, 0.8]\n")

    v = ran.samples("b", "v")
    for start, end, speed in ((21, 40, 0.25), (41, 60, 0.35), (61, 80, 0.6), (81, 100, 0.5)):
        np.testing.assert_allclose(v[start:end, 1], speed)


def test_execution_times_are_longer_by_the_factor(both: Any, tmp_path: Path) -> None:
    scenario = """
seed = 1
length_s = 1.0
[agents]
a = { program = "task:Task", parameters = { execution_ms = 2 } }
b = { program = "beacon:Beacon", parameters = { offset_ms = 5 } }
[media]
radio = { kind = "broadcast_radio" }
"""
    for host in ("inline", "process"):
        (tmp_path / host).mkdir()
        (tmp_path / host / "task.py").write_text(DOUBLED)
    ran = both('[[faults]]\nkind = "slow"\non = "a"\nfactor = 2.0\nduring_s = [0.2, 0.6]\n'
               '[[faults]]\nkind = "slow"\non = "a"\nfactor = 1.5\nduring_s = [0.4005, 0.8]\n'
               '[[faults]]\nkind = "kill"\non = "a"\nat_s = 0.505\nrestart_after_ms = 1\n', scenario)

    sent_ms = [row["offered_ns"] / MS for row in ran.copies(sender="a")]
    # a task takes as long as the factors at its release say, in each life
    longer_ms = [4 if 200 <= ms <= 400 else 6 if 400 < ms < 600 else 3 if 600 <= ms < 800 else 2
                 for ms in range(0, 1000, 10)]
    assert sent_ms == [ms + longer for ms, longer in zip(range(0, 1000, 10), longer_ms, strict=True) if ms != 500]


@pytest.mark.parametrize(("scenario", "on"), [
    ("hummingbird_chases_rovio", "quadrotor"), ("hummingbird_chases_rovio", "companion"),
    ("p3at_chases_p3at", "pursuer"), ("p3at_chases_p3at", "drive"), ("four_sensors_two_targets", "center"),
    ("four_sensors_two_targets", "sensor_?")])
def test_programs_with_execution_times_take_longer_and_keep_their_promises(
        tmp_path: Path, scenario: str, on: str) -> None:
    source = ROOT / "scenarios" / f"{scenario}.toml"
    hashes = []
    for factor in (1.0, 30.0):          # 30: longer than their periods
        document, question = read(source)
        document["faults"] = [{"kind": "slow", "on": on, "during_s": [[0.0, 1.5], [1.52, 1.5301]], "factor": factor}]
        document["expect"], document["guarantees"] = {}, {}
        loaded = load_tables(document, question, source, duration_s=2.0)
        out = tmp_path / f"{factor}"
        run(loaded, host="inline", out=out, report=False)       # a broken promise ends it with an error
        hashes.append(read_metadata(out / "ledger.parquet")["hash"])
    assert hashes[0] != hashes[1]

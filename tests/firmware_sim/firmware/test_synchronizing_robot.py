"""The synchronizing robot in C sends, bit for bit, what the one in Python sends: one ledger hash, mixed too."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import Scenario, ScenarioError, load
from marconet.running import Run

ROOT = Path(__file__).parents[3]
HASHES: dict[str, str] = tomllib.loads((ROOT / "tests/scenarios/ledger_hashes.toml").read_text())
HALF = ("r2", "r3", "r5")
ALL = ("r1", "r2", "r3", "r4", "r5")


def hash_of(name: str, out: Path, in_c: tuple[str, ...], duration_s: float | None = None,
            host: HostName = "inline") -> str:
    scenario = load(ROOT / f"scenarios/{name}.toml", duration_s=duration_s,
                    overrides=[f'agents.{robot}.firmware="synchronizing_robot"' for robot in in_c])
    assert sorted(robot for robot, agent in scenario.agents.items() if agent.program.startswith("firmware:")) == [*in_c]

    return run(scenario, host=host, out=out, report=False).summary.ledger_hash


@pytest.mark.parametrize("name", ["output_sync_reference", "output_sync"])     # told, and discovered
@pytest.mark.parametrize("in_c", [pytest.param(HALF, marks=pytest.mark.slow), ALL], ids=["half", "all"])
def test_robots_in_c_leave_the_ledger_of_robots_in_python(name: str, in_c: tuple[str, ...], tmp_path: Path) -> None:
    python = hash_of(name, tmp_path / "python", (), 1.5)

    assert hash_of(name, tmp_path / "c", in_c, 1.5) == python


def test_robots_in_c_leave_the_same_ledger_from_processes_of_their_own(tmp_path: Path) -> None:
    inline = hash_of("output_sync_reference", tmp_path / "inline", ALL, 0.5)

    assert hash_of("output_sync_reference", tmp_path / "process", HALF, 0.5, host="process") == inline


def test_robots_in_c_record_the_signals_counters_and_events_of_robots_in_python(tmp_path: Path) -> None:
    runs = []
    for in_c in ((), ALL):
        overrides = [f'agents.{robot}.firmware="synchronizing_robot"' for robot in in_c]
        result = run(load(ROOT / "scenarios/output_sync.toml", duration_s=1.0, overrides=overrides), host="inline",
                     out=tmp_path / str(len(in_c)), report=False)
        runs.append(Run(result.folder, result.summary))
    python, c = runs

    assert c.counters == python.counters
    assert c.counters["r1"]["adoptions"] == 2
    assert c.events.drop("wall_clock", strict=False).equals(python.events.drop("wall_clock", strict=False))
    assert list(c.signals) == list(python.signals)
    assert all(c.signals[node].equals(python.signals[node]) for node in python.signals)
    assert {"y", "u"} <= set(c.signals["r1"].columns)


TWO_OUTPUTS = """
seed = 2
length_s = 0.6

[team]
topology = "told"
sure = false
slot_us = 700.0
resynchronize = true
guard_s = 20e-6
requests = [
  { from_s = 0.0, links = ["* -> *"] },
  { from_s = 0.3, links = ["a -> b", "b -> c", "c -> a"] },
]

[agents_defaults]
program = "agents.synchronization.robot:SyncRobot"

[media.radio]
kind = "broadcast_radio"
preset = "crazyflie_p2p"
topology = { kind = "fixed", links = ["* -> *"] }

[[impairments]]
kind = "bernoulli_loss"
on = "radio: * -> *"
loss_ratio = 0.05
"""
ROBOT = """
[team.models.{name}]
A = [[-0.3, 1.1, 0.2], [-1.0, -0.2, 0.7], [0.1, -0.4, -0.6]]
B = [[1.0, 0.3], [0.2, 1.1], [0.0, 0.4]]
C = [[1.0, 0.1, 0.3], [0.0, 1.3, -0.2]]
K = [[2.1, 0.3], [0.7, 1.9]]
x0 = [{x0}, 0.3, -0.7]
d = [0.1, {x0}]

[agents.{name}]
plant = {{ fmu = "linear_system", parameters_from = "team.models.{name}" }}
parameters = {{ disturbance = [[0.1, 0.3], [0.2, -0.7], [0.4, 0.0]] }}
clock = {{ drift_ppm = {drift}, tick_us = 1 }}
"""


def test_robots_with_two_inputs_and_outputs_biases_disturbances_and_lost_frames_agree_too(tmp_path: Path) -> None:
    text = TWO_OUTPUTS + "".join(ROBOT.format(name=name, x0=x0, drift=drift)
                                 for name, x0, drift in (("a", 1.7, 30), ("b", -0.9, -20), ("c", 0.4, 5)))
    (tmp_path / "python.toml").write_text(text)
    (tmp_path / "c.toml").write_text(text.replace('program = "agents.synchronization.robot:SyncRobot"',
                                                  'firmware = "synchronizing_robot"'))

    summaries = [run(load(tmp_path / f"{name}.toml"), host="inline", out=tmp_path / name, report=False).summary
                 for name in ("python", "c")]

    assert summaries[1].ledger_hash == summaries[0].ledger_hash
    assert summaries[0].frames["lost"] > 50


def late(delay_ms: int, in_c: tuple[str, ...], *more: str) -> Scenario:
    """The told reference with a constant delay on all links, and own values as late."""
    return load(ROOT / "scenarios/output_sync_reference.toml", duration_s=0.7, overrides=[
        "expect={}", "guarantees={}", 'team.own_value="late"', *more,
        f'impairments=[{{on="radio: * -> *", kind="delay", delay_ms={delay_ms}}}]',
        *(f'agents.{robot}.firmware="synchronizing_robot"' for robot in in_c)])


def test_robots_in_c_use_their_own_values_as_late_as_robots_in_python(tmp_path: Path) -> None:
    """Five own values wait at a time: 14 ms with rounds of 3.25 and 2.61 ms."""
    hashes = {run(late(14, in_c), host="inline", out=tmp_path / str(len(in_c)), report=False).summary.ledger_hash
              for in_c in ((), HALF, ALL)}
    at_once = run(late(14, ALL, 'team.own_value="at once"', "team.sure=false"), host="inline", out=tmp_path / "at_once",
                  report=False)

    assert len(hashes) == 1
    assert at_once.summary.ledger_hash not in hashes


def test_a_discovered_topology_stays_though_its_values_come_later_than_a_round(tmp_path: Path) -> None:
    """In the first rounds of a new schedule frames are on their way, not missing: 5 ms with rounds of 3.25 ms."""
    def discovering(in_c: tuple[str, ...]) -> tuple[Run, str]:
        links = ["r2 -> r1", "r4 -> r1", "r3 -> r2", "r5 -> r3", "r1 -> r4", "r2 -> r4", "r3 -> r5", "r4 -> r5"]
        scenario = load(ROOT / "scenarios/output_sync.toml", duration_s=2.0, overrides=[
            "expect={}", "guarantees={}", f"media.radio.topology={{kind='fixed', links={links}}}",
            'team.own_value="late"', "team.boot_slot_s=24e-3",
            'impairments=[{on="radio: * -> *", kind="delay", delay_ms=5}]',
            *(f'agents.{robot}.firmware="synchronizing_robot"' for robot in in_c)])
        result = run(scenario, host="inline", out=tmp_path / str(len(in_c)), report=False)
        return Run(result.folder, result.summary), result.summary.ledger_hash

    (python, in_python), (_, in_c) = discovering(()), discovering(ALL)

    assert list(python.events["kind"]) == ["adopted topology"] * 5
    assert python.counters["r1"]["adoptions"] == 1
    assert in_c == in_python


def test_robots_in_c_refuse_more_own_values_than_they_keep() -> None:
    with pytest.raises(ScenarioError) as error:
        late(20, HALF, "team.sure=false")

    line, = error.value.problems
    assert ('team.own_value="late": a robot would use its own value 20000000 ns late: the firmware synchronizing_robot '
            "keeps 8 own values, expected less than 18274263 ns, 7 rounds; shorten the delay, or ") in line
    assert late(20, (), "team.sure=false")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["faults_output_sync", "output_sync", "output_sync_drift", "output_sync_formation",
                                  "output_sync_lossy", "output_sync_reference"])
def test_robots_in_c_leave_the_recorded_ledger_of_the_whole_scenario(name: str, tmp_path: Path) -> None:
    """Faults: a robot killed and restarted, a partition, a clock that jumps by more than six rounds."""
    assert hash_of(name, tmp_path, ALL) == HASHES[name]

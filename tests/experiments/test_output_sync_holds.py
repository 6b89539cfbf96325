"""Chapter 6 with observers, measurement noise and model-based holds, end to end against the exact maps."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from pathlib import Path

import numpy as np
import pytest

from agents.synchronization.closed_loop import ClosedLoop
from agents.synchronization.exact_loop import ExactLoop
from agents.synchronization.graph import Floats
from agents.synchronization.model_hold import Hold
from agents.synchronization.model_loop import ModelLoop
from agents.synchronization.noise_bounds import BiasBound, largest_outputs
from agents.synchronization.observed_loop import ObservedLoop, broadcast_noise
from agents.synchronization.partition import partition
from agents.synchronization.team import Team, read_team
from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario.library import find
from experiments.scenario.loader import load
from experiments.scenario.model import Scenario
from experiments.scenario.problems import ScenarioError
from netem.core.random_streams import stream
from netem.impairments.correlated_uniforms import normal_quantile

ROBOTS = [f"r{i}" for i in range(1, 6)]
L1_ROUND_NS = 3 * 1_084_826
SLOW_RADIO = ('media.radio.preset="crazyflie_p2p"', "media.radio.receive_latency_us=50")


def ran(name: str, tmp_path: Path, duration_s: float, overrides: Sequence[str]) -> tuple[Scenario, RunData]:
    wanted = load(find(name), duration_s=duration_s, overrides=["expect={}", "guarantees={}", *overrides])
    return wanted, load_run(run(wanted, host="inline", out=tmp_path, report=False).folder)


def outputs(data: RunData) -> Floats:
    return np.stack([data.signals[robot].column("y") for robot in ROBOTS], axis=1)


def delay_ns(data: RunData) -> int:
    delivered = data.ledger.only(fate="delivered")
    (found,) = set((delivered.ints("delivered_ns") - delivered.ints("offered_ns")).tolist())
    return int(found)


def observed_loop(team: Team) -> ObservedLoop:
    L = team.laplacian_of(team.requests[0].links)
    return ObservedLoop(tuple(team.agents), L, partition(L), [model.observer_poles for model in team.models.values()])


def noises(seed: int, level: float, kind: str, rounds: int) -> Floats:
    """The noises that the robots draw, one row for each round."""
    drawn = {robot: stream(seed, f"agents.{robot}") for robot in ROBOTS}
    shape = (lambda u: 2 * u - 1) if kind == "uniform" else normal_quantile
    return np.array([[level * shape(drawn[robot].random()) for robot in ROBOTS] for _ in range(rounds)])


@pytest.mark.parametrize(("level", "kind", "radio"), [(0.0, "uniform", ()), (0.5, "uniform", SLOW_RADIO),
                                                      (0.2, "gaussian", ())])
def test_a_run_with_observers_agrees_with_the_exact_map(tmp_path: Path, level: float, kind: str,
                                                        radio: Sequence[str]) -> None:
    wanted, data = ran("output_sync_observers", tmp_path, 1.0, [
        f"agents_defaults.parameters={{measurement_noise={level}, noise='{kind}'}}",
        f"sample_period_ms={L1_ROUND_NS * 1e-6}", *radio])

    loop, emulated = observed_loop(read_team(wanted.team)), outputs(data)
    late_ns = delay_ns(data)
    M, N = loop.round_maps(L1_ROUND_NS / 3 * 1e-9, late_ns * 1e-9)
    z, exact = loop.start(np.ones(10), np.zeros(10)), []
    for nu in noises(wanted.seed, level, kind, len(emulated)):
        exact.append(loop.outputs @ z)
        z = M @ z + N @ nu
    assert len(emulated) == 308
    assert (late_ns > 100_000) is bool(radio)
    assert np.abs(emulated - np.array(exact)).max() < 1e-9
    assert np.abs(emulated).max() > 1.0


@pytest.mark.slow
def test_with_noise_the_outputs_stay_below_the_computed_bounds(tmp_path: Path) -> None:
    """L2 with bias over the whole run; at starts of rounds, the largest output that noises of this level can cause."""
    level, length_s = 0.5, 3.0
    rest = [f"team.models.{robot}.x0={[0.0] * states}" for robot, states in zip(ROBOTS, (2, 1, 2, 2, 3), strict=True)]
    wanted, data = ran("output_sync_observers", tmp_path, length_s, [f"sample_period_ms={L1_ROUND_NS * 1e-6}", *rest])

    team, emulated = read_team(wanted.team), outputs(data)
    loop, tau_s = observed_loop(team), L1_ROUND_NS / 3 * 1e-9
    errors = [level * broadcast_noise(agent, poles, 3 * tau_s)
              for agent, poles in zip(team.agents, loop.poles, strict=True)]
    bound = BiasBound(ClosedLoop(loop.agents, loop.laplacian), 3, tau_s)
    norm = sqrt(float(np.sum(emulated**2)) * 3 * tau_s)
    assert 0 < norm < bound.of_outputs(np.zeros(10), sqrt(sum(error**2 for error in errors)), length_s)
    largest = np.abs(emulated).max(axis=0)
    assert np.all(largest < level * largest_outputs(*loop.round_maps(tau_s), loop.outputs))
    assert largest.max() > 0.05


@pytest.mark.parametrize(("hold", "slot_us", "steps", "radio"), [
    ("sender", 20_000, 4, ()), ("sender", 12_345.678, 3, SLOW_RADIO), ("team", 20_000, 4, ()),
    ("team", 12_345.678, 3, SLOW_RADIO)])
def test_a_run_with_models_agrees_with_the_exact_map(tmp_path: Path, hold: str, slot_us: float, steps: int,
                                                     radio: Sequence[str]) -> None:
    slot_ns = round(slot_us * 1000)
    wanted, data = ran("output_sync_model_holds", tmp_path, 2.0, [
        f"team.hold='{hold}'", f"team.hold_steps={steps}", f"team.slot_us={slot_us}",
        f"sample_period_ms={3 * slot_ns * 1e-6}", *radio])

    team, emulated = read_team(wanted.team), outputs(data)
    L = team.laplacian_of(team.requests[0].links)
    poles = [model.observer_poles for model in team.models.values()]
    loop = ModelLoop(tuple(team.agents), L, partition(L), poles, Hold(hold), steps)
    M, z, exact = loop.round_map(slot_ns, delay_ns(data)), loop.start(np.ones(10), np.zeros(10)), []
    for _ in emulated:
        exact.append(loop.outputs_of(z))
        z = M @ z
    assert len(emulated) == -(-2_000_000_000 // (3 * slot_ns))
    assert np.abs(emulated - np.array(exact)).max() < 1e-9
    assert np.abs(emulated).max() > 1.0


def test_slots_above_the_limit_of_held_values_work_with_models_and_fail_without(tmp_path: Path) -> None:
    slots = ["team.slot_us=12000", "team.sure=false"]
    wanted, models = ran("output_sync_model_holds", tmp_path / "models", 6.0, slots)
    _, values = ran("output_sync_model_holds", tmp_path / "values", 6.0, [*slots, 'team.hold="value"'])

    team = read_team(wanted.team)
    L = team.laplacian_of(team.requests[0].links)
    assert ExactLoop(tuple(team.agents), L, partition(L)).spectral_radius(12e-3) > 1
    decayed = np.abs(outputs(models)[500:600]).max() / np.abs(outputs(models)[200:300]).max()      # 3 s apart
    assert decayed == pytest.approx(np.exp(-0.5294 * 3), rel=0.1)       # the slowest mode of the exact map
    assert np.abs(outputs(values)[-100:]).max() > 1e6


@pytest.mark.parametrize(("scenario", "change", "rule"), [
    ("output_sync_observers", "team.models.r1.observer_poles=[-5.0]",
     "team.models.r1.observer_poles=[-5.0]: expected 2, a pole for each of the 2 states that (A, C) shows: the "
     "observability matrix has rank 2"),
    ("output_sync_observers", "team.models.r5.observer_poles=[-5.0, -6.0, -7.0]",
     "the observability matrix has rank 1, the eigenvalues -1 +1j, -1 -1j stay"),
    ("output_sync_observers", "team.models.r2.observer_poles=[5.0]",
     "team.models.r2.observer_poles=[5.0]: expected negative numbers [1/s]"),
    ("output_sync_observers", "team.models.r1.observer_poles=[-5.0, -5.0000000000001]",
     "team.models.r1.observer_poles=[-5.0, -5.0000000000001]: no gain places them with a measurement every 0.00325"),
    ("output_sync_observers", "team.models.r1.observer_x0=[1.0]",
     "team.models.r1.observer_x0=[1.0]: expected 2 values, one per state"),
    ("output_sync_observers", "agents_defaults.parameters={measurement_noise=-1.0}",
     "measurement_noise=-1.0: expected a level of 0 or more"),
    ("output_sync_observers", "agents_defaults.parameters={noise='pink'}",
     'noise="pink": expected one of uniform, gaussian'),
    ("output_sync_model_holds", "team.slot_us=29000", "spectral radius 1.00651, expected below 1; it is stable up to "
     "28.155968 ms"),
    ("output_sync_model_holds", "team.slot_us=0", 'team.hold="sender": (6.20) gives slots for values that are held'),
    ("output_sync_model_holds", "team.models.r2.observer_poles=[]", "write observer_poles for r2"),
    ("output_sync_model_holds", "team.hold_steps=0", "team.hold_steps=0: expected 1 to 1000"),
    ("output_sync_model_holds", 'team.own_value="late"', 'leave own_value = "late" out'),
    ("output_sync_model_holds", 'team.topology="discovered"', 'set topology = "told" with one request'),
    ("output_sync_model_holds", "impairments=[{on='radio: r2 -> r1', kind='delay', delay_ms=1}]",
     "impairments[0]: a value may come 1 ms late: the models bring a frame forward by airtime and receive "
     "latency alone"),
    ("output_sync_model_holds", "media.radio.receive_latency_us=6000",
     "team.hold_steps=4: a frame comes 6 ms after its slot began: expected less than 5 ms"),
    ("output_sync_observers", 'agents.r1={firmware="synchronizing_robot"}',
     "the firmware synchronizing_robot has neither observers nor models"),
])
def test_what_cannot_work_is_refused_with_the_rule_and_the_number(scenario: str, change: str, rule: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        load(find(scenario), overrides=[change, *(["agents_defaults.parameters={}"] if "firmware" in change else [])])

    assert [line for line in refused.value.problems if rule in line]

"""Robots that agree by waves, emulated: against the exact maps, a simulation told by the ledger, and the theory."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from agents.waves.network import Network
from agents.waves.output_loop import OutputLoop
from agents.waves.team import read_wave_team
from agents.waves.wave_loop import start, wave_loop
from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario import find, load
from netem.wire.level import Level
from tests.agents.waves.simulated import always, simulate_waves

SLOT_NS = 20_000_000
QUIET = ("expect={}", "guarantees={}")
# impairments of output_sync_waves, ms
RING_MS = {(0, 1): 2, (1, 0): 2, (1, 2): 20, (2, 1): 37, (2, 3): 50, (3, 2): 70, (3, 4): 200, (4, 3): 200, (4, 0): 130,
           (0, 4): 130}


def ran(tmp_path: Path, name: str, length_s: float, *overrides: str, host="inline") -> tuple[RunData, object]:
    wanted = load(find(name), duration_s=length_s, overrides=[*QUIET, *overrides])
    return load_run(run(wanted, host=host, out=tmp_path, report=False).folder), read_wave_team(wanted.team)


def on_all(keys: str) -> str:
    return f"impairments=[{{ on='radio: * -> *', {keys} }}]"


def emulated(data: RunData, team) -> np.ndarray:
    return np.stack([data.signals[name].column("y") for name in team.names], axis=1)


def instants(data: RunData) -> list[int]:
    return [int(t) for t in data.signals["r1"].time_ns]


def first_states(team) -> list[list[float]]:
    """x(0) without the integral of the output, which is the last state where there is one."""
    return [model.x0[:agent.states] for model, agent in zip(team.models.values(), team.agents, strict=True)]


def exact_outputs(team, delays_ns, at_ns) -> np.ndarray:
    network = Network(tuple(team.agents), delays_ns, team.slot_ns)
    x0 = np.concatenate(first_states(team))
    if team.waves:
        loop = wave_loop(network, team.port)
        states = loop.states_at(start(loop, x0), at_ns)
    else:
        outputs = OutputLoop(network, team.damping, team.own_value == "late")
        states = outputs.loop.states_at(outputs.start(x0), at_ns)
    return np.stack([states[:, network.states(i)] @ agent.C[0] for i, agent in enumerate(team.agents)], axis=1)


def test_five_robots_with_a_delay_of_its_own_on_every_link_are_the_exact_map(tmp_path):
    data, team = ran(tmp_path, "output_sync_waves", 20.0)

    exact = exact_outputs(team, {link: ms * 1_000_000 for link, ms in RING_MS.items()}, instants(data))

    assert len(exact) == 2000
    assert np.abs(emulated(data, team) - exact).max() < 1e-9        # the figure asked for; rounding gives 1e-13
    assert np.abs(exact[0]).max() > 3
    assert np.ptp(exact[-1]) < 1e-4
    assert min(data.signals[name].column("energy").min() for name in team.names) == 0


@pytest.mark.parametrize("slots", [0.1, 2.5, 10])
@pytest.mark.parametrize("impedance", [0.0, 7.0])
def test_two_robots_agree_with_short_and_long_delays_as_the_exact_map_says(tmp_path, slots, impedance):
    """With b = 7 and K = 2 the ports reflect waves, and the dampers in the plants are 14/9 instead of 1."""
    kappa = 14 / 9 if impedance else 1.0
    data, team = ran(tmp_path, "output_sync_waves_broken", 15.0, on_all(f"kind='delay', delay_ms={20 * slots}"),
                     "team.when_silent='zero'", "team.sure=true", f"team.impedance={impedance}",
                     *(f"team.models.r{k}.A=[[{-kappa!r}, 0.0], [1.0, 0.0]]" for k in (1, 2)))

    delays_ns = dict.fromkeys(team.edges, round(slots * SLOT_NS))
    exact = exact_outputs(team, delays_ns, instants(data))

    assert np.abs(emulated(data, team) - exact).max() < 1e-9
    assert np.ptp(exact[-1]) < 1e-3
    assert min(data.signals[name].column("energy").min() for name in team.names) == 0


def test_on_a_radio_whose_frames_take_time_the_delay_is_that_of_the_ledger(tmp_path):
    data, team = ran(tmp_path, "output_sync_waves", 5.0, "media.radio.preset='crazyflie_p2p'",
                     "media.radio.receive_latency_us=70")

    copies = data.ledger.only(fate="delivered")
    took = defaultdict(set)
    for sender, receiver, offered_ns, delivered_ns in zip(
            copies.coded("sender").values(), copies.coded("receiver").values(), copies.ints("offered_ns").tolist(),
            copies.ints("delivered_ns").tolist(), strict=True):
        took[team.names.index(sender), team.names.index(receiver)].add(delivered_ns - offered_ns)
    delays_ns = {link: next(iter(took[link])) for link in team.edges}
    assert all(len(delays) == 1 for delays in took.values())
    assert delays_ns[0, 1] == 2_000_000 + 70_000 + 196_500           # 4 us and 81 + 8 x 38 bits at 2 Mbit/s
    assert np.abs(emulated(data, team) - exact_outputs(team, delays_ns, instants(data))).max() < 1e-9


@pytest.mark.parametrize(("own_value", "slots", "grows"), [("late", 8, False), ("late", 9, True),
                                                           ("at once", 10, False)])
def test_without_waves_it_diverges_from_the_delay_at_which_the_exact_map_says_so(tmp_path, own_value, slots, grows):
    data, team = ran(tmp_path, "output_sync_unscattered", 20.0, on_all(f"kind='delay', delay_ms={20 * slots}"),
                     f"team.own_value='{own_value}'", f"team.sure={str(not grows).lower()}", "sample_period_ms=50")

    exact = exact_outputs(team, dict.fromkeys(team.edges, slots * SLOT_NS), instants(data))

    apart = np.ptp(emulated(data, team), axis=1)
    assert np.abs(emulated(data, team) - exact).max() < 1e-9 * max(1.0, np.abs(exact).max())
    assert bool(apart[-100:].max() > apart[200:300].max()) is grows


def arrivals_in_the_ledger(data: RunData, team):
    """When each copy came, from the records: the oracle is told the fates of frames and nothing else."""
    came = defaultdict(dict)
    copies = data.ledger.only(fate="delivered")
    number = {name: k for k, name in enumerate(team.names)}
    for sender, receiver, offered_ns, delivered_ns in zip(
            copies.coded("sender").values(), copies.coded("receiver").values(), copies.ints("offered_ns").tolist(),
            copies.ints("delivered_ns").tolist(), strict=True):
        came[number[sender], number[receiver]][offered_ns] = delivered_ns
    return lambda sender, receiver, k, sent_ns: came[sender, receiver].get(sent_ns)


@pytest.mark.parametrize("when_silent", ["zero", "hold"])
@pytest.mark.parametrize("keys", ["kind='bernoulli_loss', loss_ratio=0.3",
                                  "kind='delay', delay_ms=60, jitter_ms=40, distribution='uniform'"])
def test_with_losses_and_varying_delays_waves_and_energy_are_those_told_by_the_ledger(tmp_path, when_silent, keys):
    data, team = ran(tmp_path, "output_sync_waves_broken", 5.0, on_all(keys), f"team.when_silent='{when_silent}'")

    at_ns = instants(data)
    exact, least, broken = simulate_waves(team.agents, team.edges, SLOT_NS, team.port.damping, team.port.impedance,
                                  first_states(team), at_ns, arrivals_in_the_ledger(data, team),
                                  hold=when_silent == "hold")

    assert np.abs(emulated(data, team) - exact).max() < 1e-9
    seen = min(data.signals[name].column("energy").min() for name in team.names)
    if when_silent == "zero":
        assert seen >= 0
        assert min(least.values()) > -1e-12
        assert data.counters["r1"]["silent waves"] > 10
        assert data.counters["r1"]["energy breaks"] == 0
        assert broken == dict.fromkeys(team.edges)
    else:
        warned_ns = {event.node: event.time_ns for event in data.events if event.kind == "assumption violated"}
        for (_, receiver), at_broken_ns in broken.items():      # the first whole nanosecond after it
            assert abs(warned_ns[team.names[receiver]] - at_broken_ns - 0.5) <= 1
        assert min(least.values()) < -1e-3
        assert min(least.values()) - 1e-12 <= seen < 0
        assert data.counters["r1"]["energy breaks"] > 10


@pytest.mark.parametrize("when_silent", ["zero", "hold"])
def test_waves_that_are_used_later_make_a_varying_delay_the_constant_one_of_the_exact_map(tmp_path, when_silent):
    """Delays of 20 to 100 ms, each wave used 110 ms after its slot began."""
    data, team = ran(tmp_path, "output_sync_waves_broken", 5.0, "team.use_after_s=0.11", "team.sure=true",
                     f"team.when_silent='{when_silent}'")

    exact = exact_outputs(team, dict.fromkeys(team.edges, 110_000_000), instants(data))

    assert np.abs(emulated(data, team) - exact).max() < 1e-9
    assert min(data.signals[name].column("energy").min() for name in team.names) == 0
    for name in team.names:
        assert data.counters[name].get("silent waves", 0) == data.counters[name].get("late frames", 0) == 0


def test_a_wave_that_comes_after_it_is_due_is_not_used(tmp_path):
    """Of delays uniform in 20 to 100 ms, those above 60 ms are late."""
    data, team = ran(tmp_path, "output_sync_waves_broken", 5.0, "team.use_after_s=0.06", "team.sure=true",
                     "team.when_silent='zero'")

    late = [data.counters[name]["late frames"] for name in team.names]
    took = data.ledger.ints("delivered_ns") - data.ledger.ints("offered_ns")
    assert sum(late) == int((took[data.ledger.delivered] > 60_000_000).sum()) > 50
    assert min(data.signals[name].column("energy").min() for name in team.names) >= 0


def test_the_report_says_when_a_varying_delay_first_makes_a_line_give_energy(tmp_path):
    wanted = load(find("output_sync_waves_broken"), duration_s=1.0)

    result = run(wanted, host="inline", out=tmp_path)

    data = load_run(result.folder)
    told = [event for event in data.events if event.level is Level.WARNING and event.kind == "assumption violated"]
    assert sorted(event.detail.partition(": it owes")[0] for event in told) == [
        "passivity of the line r1 -> r2", "passivity of the line r2 -> r1"]
    first = data.guarantees["passive"].violations[0]
    assert first.from_ns == min(event.time_ns for event in told) == 131_699_877
    assert result.summary.verdicts[0].holds
    report = (result.folder / "report.html").read_text()
    assert "0.131699877 s" in report
    assert "passivity of the line" in report


def test_robots_as_processes_leave_the_same_ledger(tmp_path):
    wanted = load(find("output_sync_waves"), duration_s=1.0)

    hashes = {run(wanted, host=host, out=tmp_path / host, report=False).summary.ledger_hash
              for host in ("inline", "process")}

    assert len(hashes) == 1


def test_a_simulation_told_constant_delays_owes_nothing_below_zero():
    """The oracle itself: with constant delays a line's account touches 0 and never passes it."""
    wanted = load(find("output_sync_waves_broken"), overrides=list(QUIET))
    team = read_wave_team(wanted.team)

    _, least, broken = simulate_waves(team.agents, team.edges, SLOT_NS, 2.0, 2.0, first_states(team), [3_000_000_000],
                              always(dict.fromkeys(team.edges, 33_000_000)))

    assert max(abs(energy) for energy in least.values()) < 1e-12
    assert broken == dict.fromkeys(team.edges)

"""Chapter 6 end to end: real scenarios on real components, against independent answers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from agents.synchronization.closed_loop import ClosedLoop
from agents.synchronization.delayed_loop import DelayedLoop, Delays
from agents.synchronization.graph import edges
from agents.synchronization.round_plans import RoundPlans
from agents.synchronization.team import read_team
from experiments.judge.run_data import RunData, load_run
from experiments.judge.run_result import RunResult
from experiments.run.runner import run
from experiments.scenario.library import find
from experiments.scenario.loader import load
from experiments.scenario.model import Scenario
from experiments.scenario.problems import ScenarioError
from firmware_sim.slot_drift import collision_free_until
from tests.agents.synchronization.exact_run import alternating, simulate

ROBOTS = [f"r{i}" for i in range(1, 6)]
L1_HEARD = "1 hears 2,4; 2 hears 3; 3 hears 5; 4 hears 1,2; 5 hears 3,4"
L2_HEARD = "1 hears 2; 2 hears 3; 3 hears 5; 4 hears 1; 5 hears 3,4"
L1_LINKS = ["r2 -> r1", "r4 -> r1", "r3 -> r2", "r5 -> r3", "r1 -> r4", "r2 -> r4", "r3 -> r5", "r4 -> r5"]
FIXED_L1 = f"media.radio.topology={{kind='fixed', links={L1_LINKS}}}"


def scenario(name: str, duration_s: float | None = None, overrides: Sequence[str] = ()) -> Scenario:
    return load(find(name), duration_s=duration_s, overrides=overrides)


def ran(result: RunResult) -> RunData:
    return load_run(result.folder)


@pytest.mark.parametrize(("name", "length_s"), [
    ("output_sync_reference_disturbed", 5.0),       # two graphs, and the first step of the disturbance
    pytest.param("output_sync_reference_disturbed", 13.0, marks=pytest.mark.slow),
    pytest.param("output_sync_reference", 13.0, marks=pytest.mark.slow)])
def test_the_reference_run_agrees_with_the_exact_discretization(tmp_path: Path, name: str, length_s: float) -> None:
    wanted = scenario(name, length_s, ["expect={}"] if length_s < 13 else [])
    disturbance = ((0, 5.0), (4_400_000_000, -5.0), (8_800_000_000, 0.0)) if "disturbed" in name else ()

    data = ran(run(wanted, host="inline", out=tmp_path))

    team = read_team(wanted.team)
    plans = RoundPlans(team)
    requested = [plans.plan(team.laplacian_of(request.links)) for request in team.requests]
    instants = [int(t) for t in data.signals["r1"].time_ns]
    exact = simulate(team.agents, [plan for plan in requested if plan], alternating(500_000_000), wanted.length_ns,
                     instants, disturbance=disturbance)
    emulated = np.stack([data.signals[robot].column("y") for robot in ROBOTS], axis=1)
    assert len(instants) == 100 * length_s
    assert np.abs(emulated - exact.outputs).max() < 1e-9            # the figure asked for; rounding gives 1e-12
    assert np.abs(emulated).max() > 1.0


def test_with_frames_that_take_time_all_use_a_broadcast_value_from_its_arrival_its_sender_too(tmp_path: Path) -> None:
    """(6.11): the own value is the one broadcast last, measured at the slot's start, not the output of now."""
    wanted = scenario("output_sync_reference", 2.0, ['media.radio.preset="crazyflie_p2p"', "expect={}", "guarantees={}",
                                                     "media.radio.receive_latency_us=50"])

    data = ran(run(wanted, host="inline", out=tmp_path, report=False))

    team = read_team(wanted.team)
    plans = RoundPlans(team)
    requested = [plans.plan(team.laplacian_of(request.links)) for request in team.requests]
    delivered = data.ledger.only(fate="delivered")
    (delay_ns,) = set((delivered.ints("delivered_ns") - delivered.ints("offered_ns")).tolist())
    exact = simulate(team.agents, [plan for plan in requested if plan], alternating(500_000_000), wanted.length_ns,
                     [int(t) for t in data.signals["r1"].time_ns], delay_ns=delay_ns)
    emulated = np.stack([data.signals[robot].column("y") for robot in ROBOTS], axis=1)
    assert delay_ns > 100_000           # 50 us of them from the end of the frame on
    assert np.abs(emulated - exact.outputs).max() < 1e-9
    assert np.abs(emulated).max() > 1.0


@pytest.mark.parametrize(("own_value", "delay_ns", "grows"), [
    ("late", 10_000_000, False), *(pytest.param(*case, marks=pytest.mark.slow) for case in (
        ("at once", 10_000_000, True), ("at once", 4_444_444, False)))])
def test_with_delays_longer_than_a_round_the_run_agrees_with_the_exact_map(tmp_path: Path, own_value: str,
                                                                           delay_ns: int, grows: bool) -> None:
    """Sampled are the starts of rounds, between which z is multiplied by the map."""
    round_ns = 3 * 1_084_826
    wanted = scenario("output_sync_delayed", 5.0, [
        "expect={}", "guarantees={}", f"team.own_value='{own_value}'", f"sample_period_ms={round_ns * 1e-6}",
        f"team.sure={str(not grows).lower()}", f"impairments[0].delay_ms={delay_ns * 1e-6}"])

    data = ran(run(wanted, host="inline", out=tmp_path, report=False))

    team = read_team(wanted.team)
    L = team.laplacian_of(team.requests[0].links)
    own_ns = delay_ns if own_value == "late" else 0
    loop = DelayedLoop(tuple(team.agents), L, round_ns // 3, Delays(dict.fromkeys(edges(L), delay_ns), (own_ns,) * 5))
    emulated = np.stack([data.signals[robot].column("y") for robot in ROBOTS], axis=1)
    M, z, exact = loop.round_map(), loop.start(np.ones(10)), []
    for _ in emulated:
        exact.append(ClosedLoop(loop.agents, L).C_cl @ z[:10])
        z = M @ z
    assert [int(t) for t in data.signals["r1"].time_ns] == [k * round_ns for k in range(len(emulated))]
    assert len(emulated) == 1537
    assert np.abs(emulated - np.array(exact)).max() < 1e-9
    assert bool(np.abs(emulated[-300:]).max() > np.abs(emulated[300:600]).max()) is grows


def test_robots_as_processes_and_inline_leave_the_same_ledger(tmp_path: Path) -> None:
    wanted = scenario("output_sync", 1.2)

    inline = run(wanted, host="inline", out=tmp_path / "inline")
    process = run(wanted, host="process", out=tmp_path / "process")

    assert process.summary.ledger_hash == inline.summary.ledger_hash
    assert process.summary.windows == inline.summary.windows
    for robot in ROBOTS:
        assert np.array_equal(ran(process).signals[robot].values, ran(inline).signals[robot].values)


def test_another_seed_gives_another_ledger(tmp_path: Path) -> None:
    lossy = ['impairments[0].during_s=[0.0, 1.0]']
    runs = [run(load(find("output_sync"), seed=seed, duration_s=0.5, overrides=lossy), host="inline",
                out=tmp_path / str(seed)) for seed in (1, 2)]

    assert runs[0].summary.ledger_hash != runs[1].summary.ledger_hash


def test_every_robot_finds_the_graph_at_the_same_instant_after_each_change(tmp_path: Path) -> None:
    wanted = scenario("output_sync", 2.2, ["impairments=[]"])

    data = ran(run(wanted, host="inline", out=tmp_path))

    adopted = {robot: [(event.time_ns, event.detail) for event in data.events
                       if event.node == robot and event.kind == "adopted topology"] for robot in ROBOTS}
    assert all(adopted[robot] == adopted["r1"] for robot in ROBOTS)
    assert [detail for _, detail in adopted["r1"]] == [L1_HEARD, L2_HEARD, L1_HEARD, L2_HEARD, L1_HEARD]
    # Of 5 robots, 2 * 5 - 1 cycles of 5 control slots to flood, 4 more for joining late, then the end of the round. The
    # change is seen within two rounds of 5 slots at most, and a slot is at most 1.085 ms.
    bound_ns = (13 * 5 + 5 + 2 * 5 + 5) * 1_085_000
    for (found_ns, _), change_ns in zip(adopted["r1"][1:], [500_000_000, 10**9, 1_500_000_000, 2 * 10**9], strict=True):
        assert change_ns < found_ns < change_ns + bound_ns


def test_a_frame_missing_in_its_slot_starts_discovery_again(tmp_path: Path) -> None:
    lost = ('impairments=[{on="radio: r3 -> r2", kind="scripted_loss", lose_frames=[100]}]')
    wanted = scenario("output_sync", 1.0, [FIXED_L1, lost])

    data = ran(run(wanted, host="inline", out=tmp_path))

    noticed = [event for event in data.events if event.kind == "topology changed"]
    adopted = [event for event in data.events if event.kind == "adopted topology"]
    assert [event.node for event in noticed] == ["r2"]
    assert noticed[0].detail == "robot 2 missed the frame of robot 3 in its slot"
    assert [event.detail for event in adopted] == [L1_HEARD] * 10                 # at the start, and again
    lost = data.ledger.only(fate="lost", receiver="r2")
    assert 0 < noticed[0].time_ns - lost.ints("end_ns")[0] < 3 * 1_085_000        # at its own next slot


def test_a_less_conservative_bound_saves_broadcasts_and_still_synchronizes(tmp_path: Path) -> None:
    """The Wirtinger bound certifies slots of 4.58 ms for L1 where (6.20) allows 1.085 ms."""
    printed = run(scenario("output_sync", 2.0, [FIXED_L1, "impairments=[]"]), host="inline", out=tmp_path / "printed")
    longer = run(scenario("output_sync", 2.0, [FIXED_L1, "impairments=[]", "team.slot_bound='wirtinger'"]),
                 host="inline", out=tmp_path / "longer")

    saved = printed.summary.frames["delivered"] / longer.summary.frames["delivered"]
    assert 3.5 < saved < 4.58 / 1.085           # less than the ratio of the slots: both discover at the same pace
    ends = [np.abs([ran(result).signals[robot].column("y")[-20:] for robot in ROBOTS]).max()
            for result in (printed, longer)]
    assert ends[1] < 1.5 * ends[0]


@pytest.mark.slow
def test_with_biases_the_outputs_settle_at_the_equilibrium(tmp_path: Path) -> None:
    wanted = scenario("output_sync_formation")

    data = ran(run(wanted, host="inline", out=tmp_path))

    team = read_team(wanted.team)
    loop = ClosedLoop(tuple(team.agents), team.laplacian_of(L1_LINKS))
    equilibrium = loop.C_cl @ loop.equilibrium([bias[0] for bias in team.biases])
    settled = np.array([data.signals[robot].column("y")[-1] for robot in ROBOTS])
    # The slowest mode decays as exp(re t) from a start of a few units; 20 covers its overshoot and eigenvectors.
    left = 20 * np.exp(loop.rightmost_eigenvalue.real * 30.0)
    assert np.abs(settled - equilibrium).max() < left
    assert np.abs(equilibrium).max() > 0.9


def test_losses_within_the_bound_are_no_events(tmp_path: Path) -> None:
    result = run(scenario("output_sync_lossy"), host="inline", out=tmp_path)

    assert result.summary.holds, [verdict for verdict in result.summary.verdicts if not verdict.holds]
    assert not [event for event in ran(result).events if event.kind == "topology changed"]


def test_losses_beyond_the_bound_are_seen(tmp_path: Path) -> None:
    beyond = ["impairments[0].lose_frames=[1, 2]", "impairments[0].every=50"]

    data = ran(run(scenario("output_sync_lossy", 0.5, beyond), host="inline", out=tmp_path))

    seen = [event.detail for event in data.events if event.kind == "topology changed"]
    assert any("2 times in a row" in detail for detail in seen)


@pytest.mark.slow
def test_drifting_clocks_collide_unless_they_follow_each_other(tmp_path: Path) -> None:
    together = run(scenario("output_sync_drift", 4.0), host="inline", out=tmp_path / "on")
    apart = run(scenario("output_sync_drift", 4.0, ["team.resynchronize=false"]), host="inline", out=tmp_path / "off")

    assert together.summary.frames.get("collided", 0) == 0
    # By hand: r2 (+200 ppm) speaks one slot after r1 (-200 ppm) and catches up 400 us in a second; between them
    # is a slot of 1084 us less the 100.5 us on the air: 983.5 us / 400 ppm = 2.46 s.
    collided = ran(apart).ledger.only(fate="collided")
    free_ns = collision_free_until(-200.0, 200.0, 1_084_000, 100_500)
    assert abs(free_ns - 983_500 / 400e-6) < 2e6                    # the drift of the slower clock itself: 0.02 %
    assert 0 <= collided.ints("on_air_ns").min() - free_ns < 2 * 3 * 1_084_000           # within two rounds


def test_garbage_on_the_radio_is_counted_and_harms_nobody(tmp_path: Path) -> None:
    """Half of all frames arrive with flipped bits and no checksum finds it."""
    garbage = ['impairments=[{on="radio: * -> *", kind="corrupt", frame_ratio=0.5}]', "media.radio.checksum=false"]

    result = run(scenario("output_sync", 1.0, garbage), host="inline", out=tmp_path)

    assert result.summary.frames["delivered corrupt"] > 500
    counters = ran(result).counters
    assert sum(counts.get("unreadable frames", 0) + counts.get("refused control frames", 0)
               for counts in counters.values()) > 0
    assert all(np.isfinite(ran(result).signals[robot].values).all() for robot in ROBOTS)


def test_a_clock_with_a_coarse_tick_adopts_with_the_others(tmp_path: Path) -> None:
    """Its reading passes the round's end by up to a tick; the round's end is what counts."""
    coarse = ["agents.r1.clock={tick_us=7}", "impairments=[]"]

    data = ran(run(scenario("output_sync", 1.2, coarse), host="inline", out=tmp_path))

    adopted = [event for event in data.events if event.kind == "adopted topology"]
    assert [event.detail for event in adopted] == [L1_HEARD] * 5 + [L2_HEARD] * 5 + [L1_HEARD] * 5
    assert not [event for event in data.events if event.kind == "fell back"]


@pytest.mark.parametrize("changes_ms", [58, 60, 62, 63])
def test_a_change_late_in_a_discovery_does_not_split_the_team(tmp_path: Path, changes_ms: int) -> None:
    """The discovery ends at 65 ms; who hears of the change only then must not act on it alone."""
    late = ["impairments=[]", "media.radio.topology.repeat_s=100.0",
            f"media.radio.topology.schedule=[{{at_s=0.0, graph='L2'}}, {{at_s={changes_ms / 1000}, graph='L1'}}]"]

    data = ran(run(scenario("output_sync", 1.0, late), host="inline", out=tmp_path))

    last = {event.node: (event.time_ns, event.detail) for event in data.events if event.kind == "adopted topology"}
    assert set(last) == set(ROBOTS)
    assert len(set(last.values())) == 1
    assert last["r1"][1] == L1_HEARD


def test_a_team_that_has_parted_meets_again(tmp_path: Path) -> None:
    """For 30 ms, from within a discovery, r4 hears and is heard by nobody: more losses in a row than N^D allows."""
    cut = ('impairments=[{on="radio: r4 -> *", kind="bernoulli_loss", loss_ratio=1.0, during_s=[0.52, 0.55]},'
           '{on="radio: * -> r4", kind="bernoulli_loss", loss_ratio=1.0, during_s=[0.52, 0.55]}]')

    data = ran(run(scenario("output_sync", 1.4, [cut]), host="inline", out=tmp_path))

    adopted = [event for event in data.events if event.kind == "adopted topology"]
    last = {event.node: (event.time_ns, event.detail) for event in adopted}
    assert len(set(last.values())) == 1                     # together again, in the graph of the time
    assert last["r1"][1] == L1_HEARD
    assert last["r1"][0] < 1_200_000_000


@pytest.mark.parametrize(("change", "rule"), [
    ("media.radio.preset='xbee_802154'", r"a slot of 1.084 ms is shorter than its frames"),
    ("team.models.r2.K=[[-5.0]]", r"A_cl is not Hurwitz \(Assumption 6\): it has the eigenvalue 21\.6"),
    ("media.radio.topology={kind='fixed', links=['r1 <-> r2', 'r2 -> r3', 'r3 <-> r4', 'r4 <-> r5']}",
     r"the one-way link r2 -> r3 lies on no cycle \(Assumption 7\)"),
    ("team.slot_quantum_s=1e-3", r"slot_quantum_s=0\.001: longer than the slot that \(6\.20\) allows"),
    ("media.radio.max_payload_bytes=10", r"a sync frame of 5 robots has 14 bytes"),
    ("media.radio.mac='csma'", r'mac="csma": expected "none"'),
    ("agents.r1.clock={offset_us=50}", r"clocks are up to 50000 ns apart at the start"),
    ("team.boot_slot_s=2e-4", r"team\.boot_slot_s=0\.0002: expected at least 0\.000"),
])
def test_what_cannot_work_is_refused_before_the_start_with_the_rule_and_the_number(change: str, rule: str) -> None:
    with pytest.raises(ScenarioError, match=rule):
        scenario("output_sync", overrides=[change])

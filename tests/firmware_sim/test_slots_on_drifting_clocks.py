"""Slots of drifting clocks in true time, without and with resynchronization, against the formula worked out by hand."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from heapq import heappop, heappush
from itertools import combinations, permutations
from random import Random
from types import MappingProxyType

import numpy as np
import pytest

from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.schedules.slotted_broadcast import SlottedBroadcast
from firmware_sim.slot_drift import collision_free_until, largest_drift_ppm
from firmware_sim.slot_sync import Average, SlotSync
from firmware_sim.slot_sync_condition import contraction_per_round
from netem.wire.instants import NEVER_NS

SLOT_NS = 1_000_000
GUARD_NS = 20_000
AIRTIME_NS = SLOT_NS - 2 * GUARD_NS

# Who hears whom in the dissertation's (6.15), and its parts.
HEARS_L1 = {"1": "24", "2": "3", "3": "5", "4": "12", "5": "34"}
PARTS_L1 = {"1": 0, "3": 0, "2": 1, "5": 1, "4": 2}


@dataclass
class Robot:
    part: int
    settings: ClockSettings
    sync: SlotSync | None = None
    last_slot: int = -1
    next_slot: int = -1
    rounds: int = 1
    clock: LocalClock = field(init=False)


class World:
    """Who is on the air when, in true time. `hears[b]` are the names that b hears; frames in `lose` reach nobody."""

    def __init__(self, robots: Mapping[str, Robot], schedule: SlottedBroadcast, hears: Mapping[str, Collection[str]],
                 own_slot: bool = False, loss: float = 0.0) -> None:
        self.robots, self.schedule, self.hears, self.own_slot, self.loss = robots, schedule, hears, own_slot, loss
        self.now_ns = 0
        self.rng = Random("loss")
        self.on_air: list[tuple[int, int, str]] = []
        self.arrivals: list[tuple[int, str, int]] = []
        for robot in robots.values():
            robot.clock = LocalClock(robot.settings, lambda: self.now_ns)

    def run(self, until_ns: int) -> World:
        timers = {name: self.next_timer(robot) for name, robot in self.robots.items()}
        while True:
            name = min(timers, key=lambda name: (timers[name], name))
            if self.arrivals and self.arrivals[0][0] <= timers[name][0]:
                self.now_ns, sender, slot = heappop(self.arrivals)
                self.arrive(sender, slot)
                continue
            if timers[name][0] >= until_ns:
                return self
            self.now_ns, action = timers[name]
            robot = self.robots[name]
            if action == "send":
                self.send(name, robot)
            else:
                robot.rounds += 1
                self.correct(robot)
            timers[name] = self.next_timer(robot)

    def next_timer(self, robot: Robot) -> tuple[int, str]:
        robot.next_slot = self.schedule.next_slot_of(robot.part, robot.clock.now_ns() - 1, robot.last_slot).number
        send_ns = max(self.now_ns, robot.clock.true_at(self.schedule.data_ns(robot.next_slot)))
        if robot.sync is None or self.own_slot:
            return send_ns, "send"
        round_end_ns = robot.clock.true_at(self.schedule.start_ns + robot.rounds * self.schedule.round_ns)
        return min((max(self.now_ns, round_end_ns), "correct"), (send_ns, "send"))

    def send(self, name: str, robot: Robot) -> None:
        robot.last_slot = robot.next_slot
        self.on_air.append((self.now_ns, self.now_ns + AIRTIME_NS, name))
        heappush(self.arrivals, (self.now_ns + AIRTIME_NS, name, robot.last_slot))
        if self.own_slot:
            self.correct(robot)

    def arrive(self, sender: str, slot: int) -> None:
        for name, robot in self.robots.items():
            if robot.sync and sender in self.hears[name] and self.rng.random() >= self.loss:
                robot.sync.heard(sender, self.schedule.data_ns(slot), robot.clock.now_ns(), AIRTIME_NS)

    def correct(self, robot: Robot) -> None:
        assert robot.sync is not None
        step_ns, trim_ppm = robot.sync.close_round(self.schedule.round_ns)
        robot.clock.adjust(step_ns)
        robot.clock.trim(trim_ppm)

    def first_overlap_ns(self) -> int:
        """Start of the first frame that is still on the air when a frame of another part begins; NEVER_NS if none."""
        frames = sorted(self.on_air)
        latest: dict[int, tuple[int, int]] = {}
        overlaps = []
        for start_ns, end_ns, name in frames:
            part = self.robots[name].part
            overlaps += [began for other, (began, end) in latest.items() if other != part and end > start_ns]
            latest[part] = (start_ns, end_ns)
        return min(overlaps, default=NEVER_NS)

    def spread_ns(self) -> int:
        readings = [robot.clock.now_ns() for robot in self.robots.values()]
        return max(readings) - min(readings)


def world(drifts_ppm: Mapping[str, float], *, parts: Mapping[str, int] | None = None,
          offsets_ns: Mapping[str, int] = MappingProxyType({}), tick_ns: int = 1,
          hears: Mapping[str, Collection[str]] | None = None, sync: dict[str, object] | None = None,
          references: str = "", own_slot: bool = False, loss: float = 0.0) -> World:
    parts = parts or {name: i for i, name in enumerate(drifts_ppm)}
    hears = hears or {name: set(drifts_ppm) - {name} for name in drifts_ppm}
    robots = {name: Robot(parts[name], ClockSettings(offsets_ns.get(name, 0), ppm, tick_ns),
                          sync and SlotSync(**sync, reference=name in references))
              for name, ppm in drifts_ppm.items()}
    return World(robots, SlottedBroadcast(max(parts.values()) + 1, SLOT_NS, guard_ns=GUARD_NS), hears, own_slot, loss)


def by_hand_ns(drifts_ppm: Mapping[str, float], parts: Mapping[str, int],
               offsets_ns: Mapping[str, int] = MappingProxyType({}), tick_ns: int = 1, lead_less_ns: int = 0) -> int:
    """The earliest t* over all pairs of parts."""
    T = max(parts.values()) + 1
    return min(collision_free_until(drifts_ppm[slow], drifts_ppm[fast], SLOT_NS, AIRTIME_NS, tick_ns=tick_ns,
                                    lead_ns=offsets_ns.get(fast, 0) - offsets_ns.get(slow, 0) - lead_less_ns,
                                    slots_apart=(parts[fast] - parts[slow]) % T)
               for slow, fast in permutations(drifts_ppm, 2)
               if drifts_ppm[slow] < drifts_ppm[fast] and parts[slow] != parts[fast])


@pytest.mark.parametrize(("drifts_ppm", "offsets_ns"), [
    ({"a": -50.0, "b": 50.0}, {}),
    ({"a": 50.0, "b": -50.0}, {}),
    ({"a": 0.0, "b": 37.5}, {"b": 15_000}),
    ({"a": 0.0, "b": 80.0}, {"b": -30_000}),
    ({"a": -60.0, "b": 0.0, "c": 60.0}, {}),
    ({"a": 60.0, "b": 0.0, "c": -60.0}, {}),
    ({"a": -60.0, "b": -60.0, "c": 60.0}, {"a": 3_000, "b": -2_000}),
])
@pytest.mark.parametrize("tick_ns", [1, 1000])
def test_without_resynchronization_slots_collide_when_the_formula_says(drifts_ppm, offsets_ns, tick_ns):
    parts = {name: i for i, name in enumerate(drifts_ppm)}
    clean_until_ns = by_hand_ns(drifts_ppm, parts, offsets_ns, tick_ns)
    # The slow node speaks once per round of its own clock; a tick delays the fast node's frame by at most tick - 1.
    round_ns = len(parts) * SLOT_NS / (1 + min(drifts_ppm.values()) * 1e-6)
    collided_by_ns = by_hand_ns(drifts_ppm, parts, offsets_ns, lead_less_ns=tick_ns - 1) + round_ns + tick_ns

    first_ns = world(drifts_ppm, offsets_ns=offsets_ns, tick_ns=tick_ns).run(2 * clean_until_ns).first_overlap_ns()

    assert clean_until_ns < first_ns <= collided_by_ns


def test_two_nodes_of_opposite_drift_collide_after_guard_over_drift():
    """By hand: they part by 2 p t, two guards lie between frames, so t = guard / p = 20 us / 50 ppm = 0.4 s (+ a/2)."""
    clean_until_ns = collision_free_until(-50.0, 50.0, SLOT_NS, AIRTIME_NS)

    airtime_share_ns = -AIRTIME_NS / 2                         # a (1 + p) instead of a, over 2 p
    assert clean_until_ns == pytest.approx(0.4e9 + airtime_share_ns, abs=1)


def test_equal_drifts_never_collide_and_a_lead_beyond_the_free_time_collides_at_once():
    free_ns = SLOT_NS - AIRTIME_NS

    assert collision_free_until(20.0, 20.0, SLOT_NS, AIRTIME_NS, lead_ns=1000) == NEVER_NS
    assert collision_free_until(0.0, 10.0, SLOT_NS, AIRTIME_NS, lead_ns=free_ns + 1) == 0
    assert collision_free_until(10.0, 0.0, SLOT_NS, AIRTIME_NS, lead_ns=-free_ns - 1) == 0


SYNC = {"bound_ns": 5_000}


@pytest.mark.parametrize("own_slot", [False, True], ids=["at the round's end", "at the own slot"])
@pytest.mark.parametrize("tick_ns", [1, 1000])
@pytest.mark.parametrize("drifts_ppm", [{"a": -50.0, "b": 50.0}, {"a": 60.0, "b": 0.0, "c": -60.0}])
def test_with_resynchronization_slots_stay_apart_ten_times_longer(drifts_ppm, tick_ns, own_slot):
    alone_ns = by_hand_ns(drifts_ppm, {name: i for i, name in enumerate(drifts_ppm)})
    team = world(drifts_ppm, tick_ns=tick_ns, sync=SYNC, own_slot=own_slot)

    team.run(10 * alone_ns)

    assert team.first_overlap_ns() == NEVER_NS
    assert team.now_ns > 9.9 * alone_ns


@pytest.mark.parametrize("own_slot", [False, True], ids=["at the round's end", "at the own slot"])
def test_five_robots_on_one_way_links_stay_apart_although_a_third_of_the_frames_is_lost(own_slot):
    drifts_ppm = {"1": 50.0, "2": -30.0, "3": 10.0, "4": -50.0, "5": 40.0}
    alone_ns = by_hand_ns(drifts_ppm, PARTS_L1)
    team = world(drifts_ppm, parts=PARTS_L1, hears=HEARS_L1, sync=SYNC, own_slot=own_slot, loss=1 / 3)

    team.run(10 * alone_ns)

    assert team.first_overlap_ns() == NEVER_NS


@pytest.mark.parametrize(("share", "keeps_up"), [(0.95, True), (1.05, False)])
def test_resynchronization_keeps_up_until_a_rounds_drift_exceeds_both_bounds(share, keeps_up):
    bound_ns = 100                      # the bound, not the gain, is what gives in first
    limit_ppm = largest_drift_ppm(2 * SLOT_NS, SLOT_NS - AIRTIME_NS, gain=0.5, bound_ns=bound_ns)
    assert limit_ppm == pytest.approx(2 * bound_ns / (2 * SLOT_NS) * 1e6)
    drifts_ppm = {"a": -share * limit_ppm / 2, "b": share * limit_ppm / 2}
    uncorrected_ppm = 0.05 * limit_ppm
    until_ns = int(2 * (SLOT_NS - AIRTIME_NS) / (uncorrected_ppm * 1e-6))

    team = world(drifts_ppm, sync={"bound_ns": bound_ns}).run(until_ns)

    assert (team.first_overlap_ns() == NEVER_NS) is keeps_up


@pytest.mark.parametrize("gain", [0.1, 0.2, 0.3])
def test_below_the_largest_drift_the_gain_keeps_frames_apart_and_far_above_not(gain):
    slack_ns = SLOT_NS - AIRTIME_NS
    limit_ppm = largest_drift_ppm(2 * SLOT_NS, slack_ns, gain, bound_ns=GUARD_NS)
    # Each round takes back what it adds: gain (e_a + e_b) = D. The two are measured less than a round apart, so both
    # exceed D / (2 gain) - D / 2, and beyond the slack even the smaller one collides. Steps stay below the guard.
    hopeless_ppm = slack_ns / (1 / (2 * gain) - 1 / 2) / (2 * SLOT_NS) * 1e6

    def first_overlap_ns(ppm: float) -> int:
        drifts_ppm = {"a": -ppm / 2, "b": ppm / 2}
        return world(drifts_ppm, sync={"bound_ns": GUARD_NS, "gain": gain}).run(300 * SLOT_NS).first_overlap_ns()

    assert first_overlap_ns(0.99 * limit_ppm) == NEVER_NS
    assert first_overlap_ns(1.01 * hopeless_ppm) < NEVER_NS


@pytest.mark.parametrize(("bound_ns", "slots"), [(GUARD_NS, [0, 2, 4]), (2 * GUARD_NS, [0, 4])])
def test_a_step_beyond_the_guard_at_the_rounds_end_jumps_over_ones_own_slot(bound_ns, slots):
    late = {"a": -2 * bound_ns, "b": 0}
    team = world({"a": 0.0, "b": 0.0}, offsets_ns=late, hears={"a": "b", "b": ""}, sync={"bound_ns": bound_ns})

    team.run(5 * SLOT_NS)

    assert [start_ns // SLOT_NS for start_ns, _, name in team.on_air if name == "a"] == slots


def test_steps_alone_leave_the_drift_of_a_round_and_a_rate_trim_takes_it_away():
    drifts_ppm = {"a": -50.0, "b": 50.0}
    parting_ns = 100e-6 * 2 * SLOT_NS

    steps = world(drifts_ppm, sync=SYNC).run(2 * 10**9)
    trims = world(drifts_ppm, sync={**SYNC, "rate_gain": 0.2}).run(2 * 10**9)

    # Two nodes, gain 1/2: e = D / (2 gain) = D, and up to D more until the correction.
    assert parting_ns / 2 <= steps.spread_ns() <= 2 * parting_ns + 2
    assert trims.spread_ns() <= 4                       # readings, steps and errors are whole nanoseconds
    rates = [robot.clock.drift_ppm for robot in trims.robots.values()]
    assert abs(rates[0] - rates[1]) < 1e3 * 2 / (2 * SLOT_NS) * 1e3


RING = {"1": "2", "2": "3", "3": "4", "4": "1"}


@pytest.mark.parametrize("own_slot", [False, True], ids=["at the round's end", "at the own slot"])
@pytest.mark.parametrize("rate_gain", [0.2, 0.5])
@pytest.mark.parametrize(("hears", "parts"), [
    (HEARS_L1, PARTS_L1),
    (RING, {"1": 0, "2": 1, "3": 2, "4": 3}),
    (RING, {"1": 3, "2": 2, "3": 1, "4": 0}),
], ids=["one-way links L1", "ring against the order of speech", "ring in the order of speech"])
def test_clocks_with_a_rate_trim_settle_or_swing_up_as_the_eigenvalues_say(hears, parts, rate_gain, own_slot):
    drifts_ppm = dict(zip(hears, [0.05, -0.03, 0.01, -0.05, 0.04], strict=False))
    offsets_ns = dict(zip(hears, [0, 2000, -1500, 1800, -700], strict=False))
    rate = contraction_per_round(hears, parts, 0.5, rate_gain, own_slot=own_slot, airtime_share=AIRTIME_NS / SLOT_NS)
    team = world(drifts_ppm, parts=parts, offsets_ns=offsets_ns, hears=hears, own_slot=own_slot,
                 sync={"bound_ns": GUARD_NS, "rate_gain": rate_gain})
    round_ns = team.schedule.round_ns

    team.run(500 * round_ns)

    if rate < 1:
        # 4 us shrink to less than 1 ns. Readings and steps are whole: up to 2 ns a round on either side stay.
        assert 4000 * rate**500 < 1
        assert team.spread_ns() < 4 / (1 - rate)
    else:
        # Swings grow until the bound clips the steps: two guards of error at gain 1/2.
        assert team.spread_ns() > 4000


def test_all_clocks_follow_a_reference_that_reaches_everybody():
    drifts_ppm = {"1": 0.0, "2": 20.0, "3": -20.0, "4": 5.0, "5": 10.0}
    offsets_ns = {"1": 0, "2": 9_000, "3": -8_000, "4": 7_000, "5": -6_000}
    team = world(drifts_ppm, parts=PARTS_L1, offsets_ns=offsets_ns, hears=HEARS_L1, sync=SYNC, references="1")

    team.run(10**9)

    # x <- W x + D with D <= 20 ppm * 3 ms = 60 ns against the reference, so |x| <= |(I - W)^-1| D in the maximum norm
    # over the four others. Measured and read up to a round apart, that is D more on either side; 1 ns for rounding.
    W_less_I = -0.5 * np.array([[1, -1, 0, 0], [0, 1, 0, -1], [-0.5, 0, 1, 0], [0, -0.5, -0.5, 1]])
    amplification = np.abs(np.linalg.inv(W_less_I)).sum(axis=1).max()
    assert team.robots["1"].clock.now_ns() == team.now_ns
    assert team.spread_ns() <= 2 * (amplification + 2) * 61


def test_the_median_ignores_one_robot_whose_clock_has_gone_wrong():
    drifts_ppm = {"a": 0.0, "b": 0.0, "c": 0.0, "d": 0.0}
    offsets_ns = {"d": 15_000}
    hears = {"a": "bcd", "b": "acd", "c": "abd", "d": ""}

    spreads_ns = {}
    for average in Average:
        team = world(drifts_ppm, offsets_ns=offsets_ns, hears=hears, sync={**SYNC, "average": average}).run(10**8)
        readings = [team.robots[name].clock.now_ns() - team.now_ns for name in "abc"]
        spreads_ns[average] = max(abs(x - y) for x, y in combinations(readings + [0], 2))

    assert spreads_ns[Average.MEDIAN] == 0
    assert spreads_ns[Average.MEAN] > 10_000

"""Bidding among sensors that do not all hear each other: the same properties as over one hop, with bounds of h hops."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import networkx as nx
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from agents.bidding.bid_frames import STAMPS, Award, Detection, Flooded, ModeMessage, Standing, Task
from agents.bidding.flood import Flood
from tests.agents.bidding.deployments import cut, deployed_at, patterns
from tests.agents.bidding.teams import DETECTED_NS, MS, US, Team, lost
from tests.examples import examples

LINE = [(0, 1), (1, 2), (2, 3), (3, 4)]
RING = [*LINE, (4, 0)]
FIVE = [[1.0], [3.0], [2.0], [3.0], [4.0]]      # of a line: the greatest bid is four hops from the first
MODE = ModeMessage(1, Standing.DEPLOYED, Task(0, 1), 0, 1.0, 0.0, 0.0)


def directed(links: list[tuple[int, int]]) -> list[tuple[str, str]]:
    return [(f"s{i}", f"s{j}") for pair in links for i, j in (pair, pair[::-1])]


@st.composite
def graphs(draw: st.DrawFn, least: int = 3, most: int = 6) -> tuple[int, list[tuple[int, int]], int]:
    """A connected graph that is not complete: number of sensors, links, diameter in hops."""
    sensors = draw(st.integers(least, most), "sensors")
    links = {(draw(st.integers(0, i - 1)), i) for i in range(1, sensors)}
    links |= draw(st.sets(st.tuples(*[st.integers(0, sensors - 1)] * 2).filter(lambda pair: pair[0] < pair[1]),
                          max_size=3))
    hops = nx.diameter(nx.Graph(links))
    assume(hops > 1)
    return sensors, sorted(links), hops


def test_along_a_line_the_greatest_bid_is_deployed_and_each_sensor_hears_of_everything():
    team = Team(FIVE, links=LINE, hops=4, length_ns=300 * MS)

    ran = team.ran()

    [(winner, at_ns)] = ran.deployed()
    assert winner == "s4"
    assert 0 <= at_ns - DETECTED_NS - team.timing.settings.window_ns <= team.timing.apart_ns
    assert ran.counted("detections heard") == 4                 # once each, though s1 to s3 hear it twice
    assert ran.counted("deployed modes heard") >= 4
    assert ran.told("two deployed", "silent", "nobody bids") == []
    assert ran.fates == {"delivered"}
    assert ran.holds


@pytest.mark.slow
@settings(max_examples=examples(40))
@given(st.data())
def test_within_the_budget_of_losses_exactly_the_greatest_bid_is_deployed(data: st.DataObject):
    sensors, links, hops = data.draw(graphs(), "graph")
    losses = data.draw(st.integers(0, 2), "N^D")
    rewards = data.draw(st.lists(st.integers(0, 3), min_size=sensors, max_size=sensors), "rewards")
    pattern = data.draw(patterns(directed(links), losses), "lost") if losses else {}
    detects = data.draw(st.dictionaries(st.sampled_from(range(sensors)), st.integers(
        DETECTED_NS, DETECTED_NS + 30 * MS), min_size=1), "detects")
    team = Team([[float(reward)] for reward in rewards], losses, [detects], impairments=lost(pattern), links=links,
                hops=hops)
    team = replace(team, length_ns=DETECTED_NS + 2 * team.timing.settings.window_ns)

    ran = team.ran()

    [(winner, at_ns)] = ran.deployed()
    assert winner == f"s{rewards.index(max(rewards))}"
    assert at_ns <= min(detects.values()) + team.timing.settings.window_ns + team.timing.apart_ns
    assert ran.let_go() == []
    assert ran.told("silent") == []
    assert ran.counted("messages waiting") == 0
    assert max(ran.sizes.values()) <= team.timing.most_bytes
    assert ran.holds


def test_the_bound_of_a_delivery_is_not_far_from_what_happens():
    """Against the order of the slots, with the worst losses, it takes more than half of the bound."""
    worst = lost({link: [k for k in range(90) if k % 3 < 2] for link in directed(LINE)})       # 2 lost, 1 heard
    team = Team(FIVE, 2, [{4: DETECTED_NS}], impairments=worst, links=LINE, hops=4, length_ns=800 * MS)

    ran = team.ran()

    heard_ns = [at_ns for _, at_ns, _ in ran.told("window open")]
    assert len(heard_ns) == 5
    assert team.timing.delivery_ns / 2 < max(heard_ns) - DETECTED_NS <= team.timing.delivery_ns
    assert [node for node, _ in ran.deployed()] == ["s4"]


@pytest.mark.slow
@settings(max_examples=examples(25))
@given(st.data())
def test_a_winner_that_dies_is_replaced_within_the_bound(data: st.DataObject):
    sensors, links, _ = data.draw(graphs(4, 6), "graph")
    losses = data.draw(st.integers(0, 1), "N^D")
    dying = data.draw(st.sampled_from(range(sensors)), "dying")
    left = nx.Graph(links)
    left.remove_node(dying)
    assume(nx.is_connected(left))
    hops = max(2, nx.diameter(left), nx.diameter(nx.Graph(links)))
    pattern = data.draw(patterns(directed(links), losses, 120), "lost") if losses else {}
    rewards = [[float(i)] for i in range(sensors)]
    rewards[dying] = [99.0]
    team = Team(rewards, losses, impairments=lost(pattern), links=links, hops=hops)
    closes_ns = DETECTED_NS + team.timing.settings.window_ns
    killed_ns = data.draw(st.integers(closes_ns - 2 * MS, closes_ns + 2 * team.timing.silence_ns), "killed")
    team = replace(team, length_ns=max(closes_ns, killed_ns) + 2 * team.timing.takeover_ns,
                   faults=[{"kind": "kill", "on": f"s{dying}", "at_ns": killed_ns}])

    ran = team.ran()

    others = [(node, at_ns) for node, at_ns in ran.deployed() if node != f"s{dying}"]
    assert [node for node, _ in others] == [f"s{max(set(range(sensors)) - {dying})}"]
    assert killed_ns < others[0][1] <= max(killed_ns, closes_ns) + team.timing.takeover_ns
    assert ran.let_go() == []


@settings(max_examples=examples(20))
@given(st.data())
def test_after_a_partition_one_is_left_within_the_bound(data: st.DataObject):
    losses = data.draw(st.integers(0, 1), "N^D")
    links = data.draw(st.sampled_from([LINE, RING]), "links")
    first = data.draw(st.integers(1, 4), "sensors of the first part")
    rewards = data.draw(st.permutations([1.0, 2.0, 3.0, 4.0, 5.0]), "rewards")
    begin_ns = data.draw(st.integers(DETECTED_NS, DETECTED_NS + 200 * MS), "cut")
    pattern = data.draw(patterns(directed(links), losses, 300), "lost") if losses else {}
    team = Team([[reward] for reward in rewards], losses, impairments=lost(pattern), links=links, hops=4)
    heal_ns = begin_ns + 2 * team.timing.takeover_ns
    settled_ns = heal_ns + team.timing.healing_ns + team.timing.settings.window_ns
    team = replace(team, length_ns=settled_ns + 100 * MS, faults=[cut(
        (begin_ns / MS, heal_ns / MS), [f"s{i}" for i in range(first)], [f"s{i}" for i in range(first, 5)])])

    ran = team.ran()

    left = [deployed_at(ran, at_ns) for at_ns in range(settled_ns, team.length_ns, MS)]
    assert [len(each) for each in left] == [1] * len(left)
    assert len(set(map(frozenset, left))) == 1
    assert ran.counted("messages waiting") == 0
    assert ran.holds


def test_of_two_deployed_in_a_partition_the_lower_lets_go_within_the_bound():
    heal_ms = 600
    parted = cut((30, heal_ms), ["s0", "s1"], ["s2", "s3", "s4"])
    team = Team([[1.0], [2.0], [1.5], [3.0], [4.0]], 1, faults=[parted], links=LINE, hops=4, length_ns=1500 * MS)

    ran = team.ran()

    assert deployed_at(ran, heal_ms * MS - 1) == {"s1", "s4"}
    [(gone, at_ns)] = ran.let_go()
    assert gone == "s1"
    assert 0 < at_ns - heal_ms * MS <= team.timing.healing_ns
    assert deployed_at(ran, team.length_ns) == {"s4"}
    assert {node for node, _, _ in ran.told("two deployed")} == {"s1", "s4"}


def test_a_finished_task_is_finished_for_all():
    team = Team(FIVE, 1, links=LINE, hops=4, length_ns=1500 * MS, parameters={"finishes_after_ns": 50 * MS})

    ran = team.ran()

    assert len(ran.deployed()) == 1
    assert len(ran.told("window open")) == 5
    assert ran.told("silent") == []
    last_ns = max(at_ns for _, at_ns in ran.sent)
    assert last_ns <= ran.deployed()[0][1] + 50 * MS + team.timing.delivery_ns       # then nothing is due


def test_two_tasks_at_a_time_have_room_in_the_frames():
    detects = [{0: DETECTED_NS, 1: DETECTED_NS, 2: DETECTED_NS}, {4: DETECTED_NS, 3: DETECTED_NS}]
    team = Team([[5.0, 1.0], [1.0, 2.0], [2.0, 3.0], [1.0, 4.0], [1.0, 6.0]], 1, detects, links=LINE, hops=4,
                length_ns=1500 * MS)

    ran = team.ran()

    assert ([node for node, _ in ran.deployed(0)], [node for node, _ in ran.deployed(1)]) == (["s0"], ["s4"])
    assert ran.counted("messages waiting") == 0
    assert max(ran.sizes.values()) <= team.timing.most_bytes
    assert ran.counted("detections heard") == 5 * 4                # each of five by the four others


def test_a_sensor_that_boots_again_takes_part_again():
    team = Team(FIVE, links=LINE, hops=4, length_ns=600 * MS,
                faults=[{"kind": "kill", "on": "s2", "at_ms": 200, "restart_after_s": 0.02}])

    ran = team.ran()

    assert len(ran.deployed()) == 1
    assert ran.holds


@pytest.mark.parametrize("host", ["inline", "process"])
def test_processes_deploy_the_same_sensor_at_the_same_instant(host: Any):
    team = Team(FIVE, links=LINE, hops=4, length_ns=300 * MS)

    ran = team.ran(host)

    assert (ran.hash, ran.deployed()) == ((inline := team.ran()).hash, inline.deployed())


def test_what_is_not_newer_is_heard_already():
    flood = Flood(memory_ns=100 * US)
    newest = Flooded(1, 50, MODE)

    assert flood.is_new(newest, 0)
    assert not flood.is_new(newest, 10 * US)                                    # a duplicate
    assert not flood.is_new(Flooded(1, 49, MODE), 10 * US)                      # overtaken
    assert not flood.is_new(Flooded(1, 50, Award(MODE.task, 0, 1, 1.0)), 0)     # says the same
    assert flood.is_new(Flooded(2, 49, MODE), 10 * US)                          # of another sensor
    assert flood.is_new(Flooded(1, 49, Detection(0, 1, 0, 0.0, 0.0)), 10 * US)  # about something else
    assert flood.is_new(Flooded(1, 51, MODE), 10 * US)
    assert flood.is_new(Flooded(1, 3, MODE), 111 * US)                          # its clock began anew


def test_stamps_are_compared_modulo_their_range():
    flood = Flood(memory_ns=100 * US)

    assert flood.is_new(Flooded(1, STAMPS - 1, MODE), 0)
    assert flood.is_new(Flooded(1, 2, MODE), 1)
    assert not flood.is_new(Flooded(1, STAMPS - 1, MODE), 2)

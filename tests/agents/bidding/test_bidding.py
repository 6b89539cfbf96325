"""Who is deployed, over a radio with losses, partitions and deaths, within the bounds of `bid_timing`."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.agents.bidding.deployments import all_links, cut, deployed_at, patterns
from tests.agents.bidding.teams import DETECTED_NS, MS, Team, lost
from tests.examples import examples

FOUR = [[1.0], [3.0], [2.0], [3.0]]         # of equal bids the lower number wins: s1
BEST = "s1"


def test_without_losses_the_greatest_bid_is_deployed_and_nobody_else():
    team = Team(FOUR)

    ran = team.ran()

    [(winner, at_ns)] = ran.deployed()
    assert winner == BEST
    transit_ns = team.timing.transit_ns
    assert DETECTED_NS + team.timing.least_window_ns <= at_ns <= DETECTED_NS + team.timing.least_window_ns + transit_ns
    assert ran.holds
    assert ran.fates == {"delivered"}               # own slots: nothing collides
    assert ran.counted("detections heard") == 3
    assert ran.counted("awards acknowledged") == 1
    assert ran.counted("deployed modes heard") >= 3
    assert ran.counted("messages waiting") == 0
    assert ran.told("two deployed", "nobody bids", "silent") == []


def test_an_award_is_repeated_until_all_have_heard_it_or_as_often_as_losses_ask_for():
    deaf = {"kind": "kill", "on": "s0", "at_ms": 20}                # it will never acknowledge
    award, own_mode, deployed = 2 + 9 + 18, 18, 18                  # bytes: head, award and own mode; ...
    windows_ns = DETECTED_NS + Team(FOUR, 2).timing.settings.window_ns

    heard, unheard = (
        [size for (name, at_ns), size in sorted(ran.sizes.items(), key=lambda sent: sent[0][1])
         if name == BEST and at_ns > windows_ns][:4]
        for ran in (Team(FOUR, 2).ran(), Team(FOUR, 2, faults=[deaf]).ran()))

    assert heard == [award, 2 + own_mode + deployed, 2 + own_mode + deployed, 2 + deployed]
    assert unheard == [award, award, award, 2 + deployed]


def test_a_sensor_sends_in_its_slots_only_and_is_silent_when_nothing_is_due():
    team = Team(FOUR, parameters={"finishes_after_ns": 20 * MS})

    ran = team.ran()

    slot_ns, round_ns = team.timing.settings.slot_ns, team.timing.round_ns
    assert {(at_ns - slot_ns * int(name[1:])) % round_ns for name, at_ns in ran.sent} == {0}
    assert min(ran.sent)[1] > DETECTED_NS
    finished_ns = ran.deployed()[0][1] + 20 * MS
    assert max(at_ns for _, at_ns in ran.sent) <= finished_ns + team.timing.delivery_ns
    beats = [at_ns for name, at_ns in ran.sent if name == BEST and ran.deployed()[0][1] < at_ns < finished_ns]
    assert max(after - before for before, after in pairwise(beats)) == team.timing.heartbeat_ns


@pytest.mark.parametrize("host", ["inline", "process"])
def test_processes_deploy_the_same_sensor_at_the_same_instant(host: Any):
    kill = {"kind": "kill", "on": BEST, "at_ms": 30}
    team = Team(FOUR, losses=1, faults=[kill], impairments=lost({("s0", "s1"): [0], ("s3", "s2"): [0, 2]}))

    ran = team.ran(host)

    assert (ran.hash, ran.deployed()) == ((inline := team.ran()).hash, inline.deployed())
    assert [node for node, _ in ran.deployed()] == [BEST, "s3"]


@settings(max_examples=examples(25))
@given(st.data())
def test_within_the_budget_of_losses_exactly_the_greatest_bid_is_deployed(data: st.DataObject):
    losses = data.draw(st.integers(1, 3), "N^D")
    rewards = data.draw(st.lists(st.integers(0, 3), min_size=3, max_size=4), "rewards")
    pattern = data.draw(patterns(all_links(len(rewards)), losses), "lost")
    detects = data.draw(st.dictionaries(st.sampled_from(range(len(rewards))), st.integers(
        DETECTED_NS, DETECTED_NS + 5 * MS), min_size=1), "detects")
    team = Team([[float(reward)] for reward in rewards], losses, [detects], impairments=lost(pattern))

    ran = team.ran()

    [(winner, at_ns)] = ran.deployed()
    assert winner == f"s{rewards.index(max(rewards))}"
    assert at_ns <= min(detects.values()) + team.timing.settings.window_ns + team.timing.transit_ns
    assert ran.let_go() == []
    assert ran.told("silent") == []
    assert ran.counted("messages waiting") == 0
    assert ran.holds


@settings(max_examples=examples(15))
@given(st.data())
def test_a_winner_that_dies_is_replaced_within_the_bound(data: st.DataObject):
    losses = data.draw(st.integers(0, 2), "N^D")
    pattern = data.draw(patterns(all_links(4), losses), "lost") if losses else {}
    team = Team(FOUR, losses, impairments=lost(pattern), length_ns=300 * MS)
    closes_ns = DETECTED_NS + team.timing.settings.window_ns
    killed_ns = data.draw(st.integers(closes_ns - 2 * MS, closes_ns + 60 * MS), "killed")
    dying = replace(team, faults=[{"kind": "kill", "on": BEST, "at_ns": killed_ns}])

    ran = dying.ran()

    others = [(node, at_ns) for node, at_ns in ran.deployed() if node != BEST]
    assert [node for node, _ in others] == ["s3"]
    bound_ns = max(killed_ns, closes_ns) + team.timing.takeover_ns
    assert killed_ns < others[0][1] <= bound_ns
    assert ran.let_go() == []


def test_the_bound_of_the_takeover_is_not_far_from_what_happens():
    """With the worst losses the takeover takes more than half of the bound; half would be refuted."""
    never = {("s1", f"s{i}"): [k for k in range(60) if k % 3] for i in (0, 2, 3)}      # each link: 1 heard, 2 lost
    team = Team(FOUR, 2, impairments=lost(never), length_ns=200 * MS)
    late = []

    for killed_ms in (60, 66, 72, 78):
        ran = replace(team, faults=[{"kind": "kill", "on": BEST, "at_ms": killed_ms}]).ran()
        late.append(ran.deployed()[1][1] - killed_ms * MS)

    assert team.timing.takeover_ns / 2 < max(late) <= team.timing.takeover_ns


@pytest.mark.parametrize("losses", [0, 1])
def test_a_partition_during_the_bidding_deploys_two_and_after_it_one_lets_go(losses: int):
    heal_ms = 60
    parted = cut((7.6, heal_ms), ["s0", "s1"], ["s2", "s3"])    # all have heard of the task, and no bid but s0's
    team = Team([[1.0], [2.0], [1.5], [3.0]], losses, faults=[parted], length_ns=200 * MS)

    ran = team.ran()

    assert [node for node, _ in ran.deployed()] == ["s1", "s3"]
    assert deployed_at(ran, heal_ms * MS - 1) == {"s1", "s3"}
    [(gone, at_ns)] = ran.let_go()
    assert gone == "s1"                                           # the lower bid
    assert heal_ms * MS < at_ns <= heal_ms * MS + team.timing.healing_ns
    assert deployed_at(ran, 200 * MS) == {"s3"}
    told = ran.told("two deployed")
    assert told
    assert "s1 with bid 2" in told[0][2]
    assert "s3 with bid 3" in told[0][2]
    assert ran.holds                                              # its automaton allows it


@pytest.mark.slow
def test_the_bound_of_healing_is_not_far_from_what_happens():
    """Over the phases of a heartbeat, with every second frame lost both ways, more than half of the bound is needed."""
    late = []

    for phase in range(24):
        impairments = [{"on": f"radio: {link}", "kind": "scripted_loss", "lose_frames": [phase % 2], "every": 2}
                       for link in ("s3 -> s1", "s1 -> s3")]
        heal_ms = 80 + 0.6 * phase
        team = Team([[1.0], [2.0], [1.5], [3.0]], 1, impairments=impairments, length_ns=140 * MS,
                    parameters={"heartbeat_rounds": 3}, faults=[cut((7.6, heal_ms), ["s0", "s1"], ["s2", "s3"])])
        [(_, at_ns)] = team.ran().let_go()
        late.append(at_ns - heal_ms * MS)

    assert team.timing.healing_ns / 2 < max(late) <= team.timing.healing_ns


def test_of_equal_bids_the_higher_number_lets_go_after_a_partition():
    team = Team([[2.0], [1.0], [2.0]], faults=[cut((7.6, 40), ["s0"], ["s1", "s2"])])

    ran = team.ran()

    assert [node for node, _ in ran.let_go()] == ["s2"]
    assert deployed_at(ran, 100 * MS) == {"s0"}


@settings(max_examples=examples(15))
@given(st.data())
def test_after_any_partition_and_losses_one_is_left_within_the_bound(data: st.DataObject):
    losses = data.draw(st.integers(0, 1), "N^D")
    side = data.draw(st.lists(st.booleans(), min_size=4, max_size=4).filter(lambda side: 0 < sum(side) < 4), "sides")
    rewards = data.draw(st.permutations([1.0, 2.0, 3.0, 4.0]), "rewards")
    begin_ns = data.draw(st.integers(DETECTED_NS, DETECTED_NS + 60 * MS), "cut")
    pattern = data.draw(patterns(all_links(4), losses, 120), "lost") if losses else {}
    heal_ns = begin_ns + 90 * MS
    groups = [[f"s{i}" for i in range(4) if side[i] is of] for of in (True, False)]
    team = Team([[reward] for reward in rewards], losses, impairments=lost(pattern), length_ns=heal_ns + 120 * MS,
                faults=[cut((begin_ns / MS, heal_ns / MS), *groups)])

    ran = team.ran()

    settled_ns = heal_ns + team.timing.healing_ns + team.timing.settings.window_ns
    left = [deployed_at(ran, at_ns) for at_ns in range(settled_ns, team.length_ns, MS)]
    assert [len(each) for each in left] == [1] * len(left)
    assert len(set(map(frozenset, left))) == 1
    assert ran.holds


def test_a_sensor_that_wins_two_tasks_at_once_takes_the_first_and_another_the_second():
    team = Team([[5.0, 5.0], [1.0, 2.0], [2.0, 1.0]], detects=[{1: DETECTED_NS}, {2: DETECTED_NS}])

    ran = team.ran()

    first, second = sorted([*ran.deployed(0), *ran.deployed(1)], key=lambda deployed: deployed[1])
    assert first[0] == "s0"
    assert second[0] == ("s1" if ran.deployed(0) == [first] else "s2")
    assert [node for node, _, _ in ran.told("declined")] == ["s0"]
    window_ns, transit_ns = team.timing.settings.window_ns, team.timing.transit_ns
    assert second[1] <= DETECTED_NS + 2 * (window_ns + transit_ns)
    assert ran.counted("messages waiting") == 0


def test_who_gives_a_task_up_is_followed_by_the_next_after_one_window():
    team = Team(FOUR, parameters={"gives_up_after_ns": 30 * MS})

    ran = team.ran()

    (_, first_ns), (second, second_ns), *_ = ran.deployed()
    timing = team.timing
    assert second == "s3"
    assert second_ns - (first_ns + 30 * MS) <= timing.settings.window_ns + timing.delivery_ns + timing.transit_ns
    assert [node for node, _ in ran.let_go()[:1]] == ["s1"]


def test_a_task_for_which_nobody_bids_is_told_and_nobody_is_deployed():
    ran = Team([[], [], []]).ran()

    assert ran.deployed() == []
    assert ran.told("nobody bids")


def test_a_finished_task_is_finished_for_all_and_opens_no_window():
    team = Team(FOUR, losses=1, parameters={"finishes_after_ns": 10 * MS}, length_ns=300 * MS,
                impairments=lost({("s1", "s2"): [2, 4, 6, 8, 10, 12]}))

    ran = team.ran()

    assert len(ran.deployed()) == 1
    assert len(ran.told("window open")) == 4
    assert ran.told("silent") == []


def test_who_opens_a_window_later_closes_it_with_those_who_heard_of_it_first():
    # s1 has lost the first frame of s0 when it detects the target itself
    team = Team(FOUR, 1, [{0: DETECTED_NS, 1: DETECTED_NS + MS}], impairments=lost({("s0", "s1"): [0]}))

    ran = team.ran()

    [(winner, at_ns)] = ran.deployed()
    assert winner == BEST
    assert ran.told("window open")[1][0] == "s2"
    assert at_ns <= DETECTED_NS + team.timing.settings.window_ns + team.timing.transit_ns


def test_a_deployed_sensor_that_has_much_to_tell_is_not_taken_for_dead():
    # s1 detects another target in each round, for longer than the silence after which it would be
    round_ns = Team(FOUR, detects=[{}, {}, {}]).timing.round_ns
    detects = [{0: DETECTED_NS}, *({1: 60 * MS + k * round_ns} for k in range(10))]
    team = Team(FOUR, detects=detects, length_ns=200 * MS)

    ran = team.ran()

    assert 10 * round_ns > 3 * team.timing.silence_ns
    assert ran.told("silent") == []
    assert len(ran.deployed()) == 1


@pytest.mark.parametrize(("heal_ms", "who"), [(48.5, ["s1"]), (70, ["s1", "s0"])])
def test_who_has_not_heard_that_a_task_is_finished_is_told_so_when_it_bids(heal_ms: float, who: list[str]):
    # s1 finishes the task while s0 is cut off; s0 takes it for dead, and bids, or is deployed, before it hears again
    team = Team(FOUR, 1, parameters={"finishes_after_ns": 20 * MS}, length_ns=120 * MS,
                faults=[cut((37, heal_ms), ["s0"], ["s1", "s2", "s3"])])

    ran = team.ran()

    assert 37 * MS < ran.deployed()[0][1] + 20 * MS < 40 * MS
    assert [node for node, _ in ran.deployed()] == who
    assert ran.told("silent")[0][0] == "s0"
    assert ran.told("mode")[-1][2].split(" at")[0] == "deployed -> waiting"
    assert [node for node, at_ns, _ in ran.told("window open")] == ["s0", "s1", "s2", "s3", "s0"]
    assert ran.holds


def test_who_is_deployed_for_a_finished_task_is_told_so_by_its_next_heartbeat():
    # s1 finishes the task just before s0 is cut off and has heard of it; s0 takes it for dead and is deployed itself
    heal_ms = 140
    team = Team(FOUR, 1, parameters={"finishes_after_ns": 60 * MS}, length_ns=250 * MS,
                faults=[cut((78.5, heal_ms), ["s0"], ["s1", "s2", "s3"])])

    ran = team.ran()

    assert [node for node, _ in ran.deployed()] == ["s1", "s0"]
    node, at_ns, detail = ran.told("mode")[-1]
    assert node == "s0"
    assert detail.endswith(": the task is over")
    told_ns = heal_ms * MS + team.timing.healing_ns + team.timing.delivery_ns
    assert at_ns <= told_ns < ran.deployed()[1][1] + 60 * MS            # before it would have finished by itself


def test_a_sensor_that_boots_again_hears_who_is_deployed_and_starts_nothing():
    team = Team(FOUR, faults=[{"kind": "kill", "on": "s0", "at_ms": 20, "restart_after_s": 0.02}])

    ran = team.ran()

    assert len(ran.deployed()) == 1
    assert len(ran.told("window open")) == 4
    assert ran.holds


def test_a_deaf_sensor_that_takes_the_winner_for_dead_is_put_right_when_it_hears_again():
    team = Team(FOUR, faults=[cut((20, 70), ["s0"], ["s1", "s2", "s3"])])

    ran = team.ran()

    assert [node for node, _ in ran.deployed()] == ["s1", "s0"]
    assert [node for node, _ in ran.let_go()] == ["s0"]
    assert deployed_at(ran, 100 * MS) == {"s1"}

"""Scenarios in which the protocol could not keep its bounds, each with the number that would do."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest

from experiments.scenario import ScenarioError
from tests.agents.bidding.teams import MS, RADIO, US, Team

FOUR = [[1.0], [3.0], [2.0], [3.0]]


def refused(of: Team, **changes: Any) -> str:
    with pytest.raises(ScenarioError) as error:
        of.scenario(**changes)
    return "\n".join(line.removeprefix("team.toml: ") for line in error.value.problems)


def test_a_window_shorter_than_its_frames_is_refused_with_the_number_that_would_do():
    # 3 rounds of 4 slots of 0.6 ms until all have heard of the task, and a slot; as much for the bids
    needed_ns = 2 * (3 * 4 * 600 * US + 600 * US)

    said = refused(Team(FOUR, 2, parameters={"window_ns": needed_ns - 1}))

    assert said == (f"agents.s0.parameters.window_ns={needed_ns - 1}: the bid window is shorter than its "
                    "frames: 3 rounds of 4 slots of 600000 ns until all have heard of it, and as many until all have "
                    f"heard the bids; take at least {needed_ns} ns")
    Team(FOUR, 2, parameters={"window_ns": needed_ns}).scenario()


LINE = [(0, 1), (1, 2), (2, 3)]


def test_a_window_shorter_than_its_hops_is_refused_with_the_number_that_would_do():
    # for each of three hops 3 rounds of 4 slots, and a slot; as much for the bids
    team = Team(FOUR, 2, links=LINE, hops=3)
    slot_ns = team.settings["slot_ns"]
    needed_ns = 2 * 3 * (3 * 4 * slot_ns + slot_ns)

    said = refused(replace(team, parameters={"window_ns": needed_ns - 1}))

    assert said == (f"agents.s0.parameters.window_ns={needed_ns - 1}: the bid window is shorter than its "
                    f"frames: 3 rounds of 4 slots of {slot_ns} ns until all have heard of it, for each of 3 hops, and "
                    f"as many until all have heard the bids; take at least {needed_ns} ns")
    replace(team, parameters={"window_ns": needed_ns}).scenario()


@pytest.mark.parametrize("hops", [1, 2])
def test_sensors_further_apart_than_the_hops_are_refused_with_the_number_that_would_do(hops: int):
    assert refused(Team(FOUR, links=LINE, hops=hops)).endswith(
        f"agents.s0.parameters.most_hops={hops}: on media.radio s0 hears s3 over 3 hops; take 3, which "
        "lengthens the window")
    Team(FOUR, links=LINE, hops=3).scenario()


def test_a_sensor_that_no_hops_reach_is_refused():
    said = refused(Team(FOUR, links=LINE[:2], hops=3))

    assert said == ("media.radio: nothing that s0 sends reaches s3, over any number of hops; add a link, or a sensor "
                    "that passes it on")


def test_a_slot_of_those_who_flood_holds_what_all_have_to_tell():
    team = Team(FOUR, links=LINE, hops=3)
    needed_ns = (2 + 4 * 24 + 4 * 25 + 13 + 3 * 24) * 8 * US + 20 * US

    said = refused(replace(team, parameters={"slot_ns": needed_ns - 1}))

    assert f"take at least {needed_ns} ns" in said
    assert team.settings["slot_ns"] == needed_ns


def test_a_slot_shorter_than_its_frame_is_refused_with_the_number_that_would_do():
    # 69 bytes at 1 Mbit/s, and the receive latency
    assert "take at least 572000 ns" in refused(Team(FOUR, parameters={"slot_ns": 572 * US - 1}))
    Team(FOUR, parameters={"slot_ns": 572 * US}).scenario()


def test_clocks_that_drift_apart_need_longer_slots_and_windows():
    team = Team(FOUR, length_ns=1_000 * MS)
    agents = {name: {"program": "agents.bidding.bidding_robot:BiddingRobot", "parameters": team.settings,
                     "clock": {"drift_ppm": 50.0 if name == "s2" else -30.0, "offset_ns": 20 * US * (name == "s3")}}
              for name in team.names}

    with pytest.raises(ScenarioError) as error:
        team.scenario(agents=agents)

    slot, window = error.value.problems
    assert "take at least 672000 ns" in slot                # 572 us, 20 us of offset, 80 us of drift in 1 s
    assert f"take at least {round(team.timing.least_window_ns * (1 + 80e-6))} ns" in window


@pytest.mark.parametrize(("changes", "said"), [
    ({"team": {}}, "team.sensors=None: expected 2 to 254 names, each once"),
    ({"team": {"sensors": ["s0", "s0", "s1", "s2", "s3"]}}, "each once"),
    ({"team": {"sensors": ["s0", "s1", "s2", "s3", "s4"]}}, "team.sensors: s4: no such agents"),
    ({"team": {"sensors": ["s0", "s1", "s2"]}}, "agents.s3: is not in team.sensors"),
    ({"media": {"radio": RADIO | {"mac": "aloha"}}}, 'media.radio.mac="aloha": expected "none"'),
    ({"media": {"radio": RADIO | {"max_payload_bytes": 68}}}, "a frame of so many tasks has up to 69 bytes"),
    ({"media": {"other": RADIO}}, "media.radio: bidding needs a broadcast_radio of this name"),
    ({"impairments": [{"on": "radio: s0 -> s1", "kind": "delay", "delay_ms": 3}]},
     "agents.s0.parameters.delay_ns=0: impairments[0] delays a copy by up to 3000000 ns"),
])
def test_what_no_team_can_keep_is_refused(changes: dict[str, Any], said: str):
    assert re.search(re.escape(said), refused(Team(FOUR), **changes))


def test_sensors_with_other_times_are_refused():
    team = Team(FOUR)
    agents = {name: {"program": "agents.bidding.bidding_robot:BiddingRobot",
                     "parameters": team.settings | ({"heartbeat_rounds": 9} if name == "s2" else {})}
              for name in team.names}

    assert "agents.s2.parameters.heartbeat_rounds=9: expected 2, as agents.s0 has it" in refused(team, agents=agents)


@pytest.mark.parametrize("wrong", [{"slot_ns": 0}, {"heartbeat_rounds": 0}, {"max_successive_losses": -1},
                                   {"most_tasks": 0}, {"most_hops": 0}, {"rewards": [1e40]}])
def test_numbers_out_of_range_are_refused(wrong: dict[str, Any]):
    team = Team(FOUR)
    agents = {name: {"program": "agents.bidding.bidding_robot:BiddingRobot", "parameters": team.settings | wrong}
              for name in team.names}

    with pytest.raises(ScenarioError, match="expected"):
        team.scenario(agents=agents)

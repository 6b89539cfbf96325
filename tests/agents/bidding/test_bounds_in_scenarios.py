"""The numbers in the formulas of scenarios are those that `bid_timing` derives from their settings."""

from __future__ import annotations

import pytest

from agents.bidding.bid_timing import BiddingSettings, BidTiming
from experiments.scenario import find, load
from experiments.scenario.model import Scenario

S = 1_000_000_000


def timing_of(scenario: Scenario) -> BidTiming:
    sensors = scenario.team["sensors"]
    given = scenario.agents[sensors[0]].parameters
    known = {key: given[key] for key in BiddingSettings.__dataclass_fields__ if key in given}
    return BidTiming(len(sensors), BiddingSettings(**known))


@pytest.mark.parametrize(("name", "key", "fault", "bound"), [
    ("bidding_team", "taken_over", 0, "takeover_ns"),
    ("bidding_team", "one_again", 1, "healing_ns"),
    ("bidding_hops", "taken_over", 0, "takeover_ns"),
    ("bidding_hops", "taken_for_dead", 1, "takeover_ns"),
    ("bidding_hops", "one_again", 1, "healing_ns"),
    ("marco_polo_faults", "one_after_it", 1, "healing_ns"),
    ("marco_polo_faults", "taken_over", 2, "takeover_ns"),
    ("marco_polo_faults", "two_in_the_jam", 3, "takeover_ns"),
    ("marco_polo_faults", "one_after_the_jam", 3, "healing_ns"),
])
def test_a_formula_begins_a_derived_bound_after_its_fault(name: str, key: str, fault: int, bound: str):
    scenario = load(find(name))
    [(begins_ns, ends_ns)] = scenario.faults[fault].occurrences
    after_ns = ends_ns if bound == "healing_ns" else begins_ns
    from_s = (after_ns + getattr(timing_of(scenario), bound)) / S

    assert scenario.expect[key].formula.startswith(f"always[{from_s:g} s, ")


@pytest.mark.parametrize("name", ["bidding_team", "bidding_hops"])
def test_the_choice_is_expected_a_window_and_a_slot_for_each_hop_after_the_detection(name: str):
    scenario = load(find(name))
    timing = timing_of(scenario)
    detected_ns = scenario.agents["s1"].parameters["detects_ns"][0]

    assert scenario.expect["chosen"].formula.startswith(
        f"always[{(detected_ns + timing.settings.window_ns + timing.apart_ns) / S:g} s, ")


def test_the_times_of_a_window_and_of_an_exposure_are_those_of_the_game():
    scenario = load(find("marco_polo_faults"))
    timing, view = timing_of(scenario), scenario.media["view_uav"].settings
    blind, parted = (scenario.faults[index].occurrences[0] for index in (0, 1))
    detected_ns = 15_520_000_000                # by ugv_1, the second detection of target_1

    assert detected_ns < parted[0] < detected_ns + timing.settings.window_ns
    closed_ns = detected_ns + timing.settings.window_ns + timing.apart_ns
    assert scenario.expect["two_in_the_partition"].formula.startswith(f"always[{closed_ns / S:g} s, ")
    seen_ns = blind[1] + view.exposure_period_ns + view.latency_ns
    assert scenario.expect["sees_again"].formula.startswith(f"eventually[{blind[1] / S:g} s, {seen_ns / S:g} s]")

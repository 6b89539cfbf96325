"""`marconet check` judges a delay of looks by what it leaves of tau*, link by link."""

from __future__ import annotations

import pytest

from agents.tracking.controller import Inputs
from agents.tracking.error_system import TrackingErrorSystem
from agents.tracking.look_delay import NONE, LookDelay, look_delay, told
from agents.tracking.section_4_6 import GAINS
from agents.triggering.policies.table import build_policy
from experiments.scenario import ScenarioError, load
from experiments.scenario.library import find

AIR_US = 56.5, 216.5            # airtime of request and answer on crazyflie_p2p: 4 us, 81 + 8 n bits at 2 Mbit/s


def delayed(*impairments: str) -> list[str]:
    written = ", ".join(f'{{ on = "{link}", kind = "delay", delay_us = {us} }}' for link, us in (
        each.split("=") for each in impairments))
    return [f"impairments=[{written}]"]


def problem(overrides: list[str], name: str = "tracking_delayed") -> str:
    with pytest.raises(ScenarioError) as error:
        load(find(name), overrides=overrides)
    return str(error.value)


@pytest.mark.parametrize("delay_ms", [5, 10, 17])
def test_a_delay_that_leaves_an_interval_is_accepted(delay_ms: int) -> None:
    scenario = load(find("tracking_delayed"), overrides=delayed(f"radio: reference -> companion={delay_ms * 1000}"))

    found = look_delay(scenario, "companion")

    assert found.total_ns == delay_ms * 1_000_000 + round(1000 * sum(AIR_US))
    assert (found.request_ns, found.setpoint_ns, found.airtime_ns) == (56_500, 0, 273_000)


def test_19_ms_are_refused_with_place_value_rule_and_remedy() -> None:
    said = problem(delayed("radio: reference -> companion=19000"))

    assert said == (
        "tracking_delayed.toml: impairments[0]: agents.companion: a look takes up to 19.273 ms until its command acts, "
        "19.000 ms of them by impairments, and the small-gain condition (4.37) holds for tau* = 18.388 ms after a "
        "request with inputs (1, 1) at x = 0: expected less, as the interval may be tau* - d at most; shorten the "
        "delay, or use smaller gains, or set agents.companion.parameters.sure = false to run it all the same")


def test_delays_of_request_answer_and_setpoint_add_up_and_other_links_do_not_count() -> None:
    links = ["radio: companion -> reference=2000", "radio: reference -> companion=3000", "can: companion -> drive=4000",
             "can: drive -> companion=50000"]
    scenario = load(find("tracking_delayed"), overrides=delayed(*links))

    assert look_delay(scenario, "companion") == LookDelay(
        2_056_500, 3_216_500, 4_000_000, 2_056_500, 3_216_500, 273_000, 9_000_000,
        ("impairments[0]", "impairments[1]", "impairments[2]"))
    assert "impairments[0] and impairments[1] and impairments[2]" in problem(delayed(*(
        link.partition("=")[0] + "=7000" for link in links[:3])))


def test_a_delay_in_a_window_counts_as_the_most_and_not_as_the_least() -> None:
    scenario = load(find("tracking_delayed"), overrides=[
        'impairments=[{ on = "radio: * -> *", kind = "delay", delay_ms = 3, during_s = [1.0, 2.0] }]'])

    found = look_delay(scenario, "companion")

    assert (found.request_ns, found.answer_ns) == (3_056_500, 3_216_500)
    assert (found.least_request_ns, found.least_answer_ns) == (56_500, 216_500)


def test_receive_latency_counts_on_both_ways() -> None:
    said = problem(["impairments=[]", "media.radio.receive_latency_ms=9.2"])

    assert said.startswith("tracking_delayed.toml: media.radio.receive_latency_s: agents.companion: a look takes up to "
                           "18.673 ms")


def test_the_inputs_with_the_shortest_tau_decide_and_the_policy_s_gains() -> None:
    delay = delayed("radio: reference -> companion=17000")

    assert "tau* = 17.200 ms after a request with inputs (2, 2)" in problem(delay, "tracking_individual")
    unified_ns = build_policy("unified_gain", TrackingErrorSystem(), GAINS).decide(0, (0.0,) * 3, Inputs(1, 1)).valid_ns
    assert f"tau* = {unified_ns / 1e6:.3f} ms" in problem([*delay, 'agents.companion.parameters.policy="unified_gain"'])


def test_an_interval_shorter_than_the_frames_of_a_look_is_refused() -> None:
    assert "the interval left, 0.115 ms, is shorter than the frames of a look, 0.273 ms" in problem(
        delayed("radio: reference -> companion=18000"))


def test_a_robot_in_c_needs_an_interval_longer_than_a_look() -> None:
    in_c = "agents.companion={firmware='tracking_robot',media=['radio','can']}"

    assert "this robot sends no request before the last one is answered; use the program in Python" in problem(
        [*delayed("radio: reference -> companion=10000"), in_c])
    assert load(find("tracking_delayed"), overrides=[*delayed("radio: reference -> companion=8000"), in_c])


def test_without_a_delay_nothing_is_told_and_with_one_what_was_told_is_read() -> None:
    assert look_delay(load(find("tracking_individual")), "companion") == told({}, "companion") == NONE
    assert told({"look_delays": {"r1": {"request_ns": 5, "places": ["a"]}}}, "r1") == LookDelay(5, places=("a",))

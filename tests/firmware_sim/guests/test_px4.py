"""PX4 as a guest, against a client written from the public description (`px4_client.py`): no PX4 can be had here."""

from __future__ import annotations

from math import exp

import pytest

import marconet
from tests.firmware_sim.guests.pilot import BANDWIDTH

PX4 = "firmware_sim.guests.px4:Px4Guest"


def settles_within_m(seconds: float, goal_m: float) -> float:
    """Return the distance to the goal of a critically damped loop of the pilot's bandwidth, and 5 cm for the motors."""
    return goal_m * (1 + BANDWIDTH * seconds) * exp(-BANDWIDTH * seconds) + 0.05


def test_it_takes_off_and_hovers_in_lockstep(fly):
    flight = fly("px4", PX4)
    guest = flight.guests[0]
    assert flight.final("z") == pytest.approx(1.5, abs=settles_within_m(4.0, 1.5))
    assert guest["height_m"] == pytest.approx(flight.final("z"), abs=0.02)
    counted = flight.run.counters["v1"]
    assert counted["steps"] == 1250                     # one every 4 ms
    assert counted["steps without answer"] == 0
    assert guest["times_grow"]
    assert guest["groups"]
    assert guest["bad"] == 0
    assert guest["repeats"] == 0                        # PX4 takes a sensor that repeats itself for broken
    assert guest["rest_z"] == pytest.approx(-9.81, abs=0.2)         # 10 sigma; at rest it measures minus gravity
    boot_steps = guest["sensors"] - 1250
    assert guest["gps"] in {25 + 1, 25 + 2}             # every 200 ms of virtual time, and once or twice while booting
    assert boot_steps >= 25                             # 100 ms of its time
    assert guest["truths"] >= 1000                      # asked for every 5 ms: at least every second step
    assert guest["pressure_hpa"] == pytest.approx(955.8, abs=0.5)   # standard atmosphere at 489.5 m


@pytest.mark.slow
def test_the_same_flight_has_the_same_hash(fly):
    hashes = {fly("px4", PX4, length_s=2.0).run.ledger_hash for _ in range(3)}
    assert len(hashes) == 1
    assert fly("px4", PX4, length_s=2.0, host="inline").run.ledger_hash in hashes


@pytest.mark.slow
def test_two_vehicles_share_a_medium(fly):
    flight = fly("px4", PX4, vehicles=2, length_s=4.0)
    assert [guest["height_m"] for guest in flight.guests] == [pytest.approx(1.5, abs=settles_within_m(3.0, 1.5)),
                                                              pytest.approx(2.5, abs=settles_within_m(3.0, 2.5))]
    sent = sum(flight.run.counters[name]["telemetry sent"] for name in ("v1", "v2"))
    assert sent >= 2 * 35                               # a heartbeat every 100 ms
    assert flight.run.counters["ground"]["heard"] == sent or flight.run.counters["ground"]["heard"] == sent - 2
    for guest in flight.guests:
        assert guest["heard"] >= 7                      # the ground speaks every 0.5 s; besides, the other's heartbeats


def refused(fly, what: str, **more) -> str:
    with pytest.raises(marconet.NodeFailure) as refusal:
        fly("px4", PX4, what, length_s=3.0, **more)
    return str(refusal.value)


def test_a_guest_that_leaves_ends_the_run(fly):
    assert "agents.v1: the autopilot has closed its connection" in refused(fly, "leaves")


def test_a_guest_that_stops_answering_ends_the_run_after_its_time(fly):
    found = refused(fly, "silent", answer_within_s=0.2, gone_after_s=0.6)
    assert "agents.v1: PX4 is armed and has not answered for 0.6 s" in found


def test_a_guest_that_never_answers_is_told_before_virtual_time_begins(fly):
    found = refused(fly, "never", connect_within_s=2.0)
    assert "sent no HIL_ACTUATOR_CONTROLS for 2 s of sensors" in found


def test_a_late_answer_is_counted_and_the_flight_goes_on(fly):
    flight = fly("px4", PX4, "slow", length_s=3.0, answer_within_s=0.05)
    counted = flight.run.counters["v1"]
    assert counted["steps without answer"] > 0
    assert 0 < (flight.run.events["kind"] == "guest late").sum() <= counted["steps without answer"]
    assert flight.final("z") == pytest.approx(1.5, abs=settles_within_m(2.0, 1.5))


def test_garbage_between_messages_is_counted(fly):
    flight = fly("px4", PX4, "noise", length_s=2.0)
    assert flight.run.counters["v1"]["noise bytes from PX4"] > 1000
    assert flight.final("z") > 0.5


def test_nobody_connects(tmp_path):
    scenario = marconet.Scenario("alone", folder=tmp_path, length_s=1.0, seed=1, agents={"v1": {
        "program": PX4, "plant": {"fmu": "quadrotor"}, "parameters": {"connect_within_s": 0.3,
                                                                      "listen": "127.0.0.1:45601"}}})
    with pytest.raises(marconet.NodeFailure, match=r"no autopilot has connected to 127\.0\.0\.1:45601 within 0\.3 s"):
        marconet.run(scenario, host="inline", out=tmp_path / "run")


@pytest.mark.parametrize(("parameters", "words"), [
    ({"listen": "0.0.0.0:4560"}, "an IPv4 address of the loopback"),
    ({"listen": "127.0.0.1:0"}, "a port from 1 to 65535"),
    ({"step_ns": 4_000_500}, "whole microseconds"),
    ({"motors": {"channels": [1, 2, 2, 4]}}, "four different channels"),
    ({"motors": {"motor_min_radps": 900.0}}, "less than motor_max_radps"),
    ({"sensors": {"barometer_sigma_hpa": -1.0}}, "a finite number, 0 or more"),
    ({"answer_within_s": 0.0}, "more than 0 seconds"),
    ({"telemetry": {"port": "radio"}}, "expected one of no medium"),
])
def test_settings_that_cannot_work_are_refused(tmp_path, parameters, words):
    with pytest.raises(marconet.ScenarioError, match=words):
        marconet.Scenario("bad", folder=tmp_path, length_s=1.0, seed=1, agents={"v1": {
            "program": PX4, "plant": {"fmu": "quadrotor"}, "parameters": parameters}})


def test_two_vehicles_on_one_port_and_one_without_a_plant_are_refused(tmp_path):
    with pytest.raises(marconet.ScenarioError) as refusal:
        marconet.Scenario("bad", folder=tmp_path, length_s=1.0, seed=1, agents={
            "v1": {"program": PX4, "plant": {"fmu": "quadrotor"}}, "v2": {"program": PX4}})
    assert "agents.v2.parameters.listen=127.0.0.1:4560: agents.v1 listens there, too" in str(refusal.value)
    assert "agents.v2: PX4 needs a plant" in str(refusal.value)


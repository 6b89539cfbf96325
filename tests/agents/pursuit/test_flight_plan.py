"""The ground's orders to a flying pursuer, against a MAVLink front with a stand-in vehicle and a link that loses."""

from __future__ import annotations

from random import Random

import pytest

from agents.pursuit.flight_plan import FlightPlan, Phase
from firmware_sim.autopilot.vehicle import Mode, PositionTarget
from firmware_sim.mavlink.companion import Companion
from firmware_sim.mavlink.link import MavlinkLink
from tests.firmware_sim.mavlink.ground import Ground

MS = 1_000_000
STEP_NS = 70 * MS
HEIGHT_M = 1.5                  # of the stand-in's take-off


class Flight:
    """A plan and a vehicle; `loss` is the share of messages that each direction loses."""

    def __init__(self, loss=0.0, seed=1):
        self.rng, self.loss = Random(seed), loss
        self.ground = Ground(quiet=False)
        self.client = Companion(MavlinkLink(245, 190))
        self.events = []
        self.plan = FlightPlan(self.client, HEIGHT_M, (("LOCAL_POSITION_NED", 100 * MS), ("ATTITUDE", 0)),
                               *[lambda kind, detail: self.events.append((kind, detail))] * 2)
        self.orders = []

    def step(self):
        now_ns = self.ground.now_ns
        self.plan.step(now_ns)
        frames = self.client.step(now_ns)
        if self.plan.leads:
            frames.append(self.client.target(PositionTarget((0.0, 0.0, -HEIGHT_M)), now_ns))
        self.orders += [frame for frame in frames if frame[7] == 76]       # COMMAND_LONG
        up = b"".join(frame for frame in frames if self.rng.random() >= self.loss)
        while self.ground.now_ns < now_ns + STEP_NS:
            self.ground.now_ns += 5 * MS
            self.ground.vehicle.advance(self.ground.now_ns)
            for frame in self.ground.front.step([up], self.ground.now_ns)[0]:
                if self.rng.random() >= self.loss:
                    self.client.hear(frame, self.ground.now_ns)
            up = b""

    def until(self, phase, within_s=60.0):
        end_ns = self.ground.now_ns + within_s * 1e9
        while self.plan.phase is not phase:
            assert self.ground.now_ns < end_ns, self.events
            self.step()

    def go_on(self, seconds):
        for _ in range(round(seconds * 1e9 / STEP_NS)):
            self.step()


def test_without_losses_each_order_is_given_once_and_the_vehicle_flies():
    flight = Flight()

    flight.until(Phase.CHASE)

    phases = [detail for kind, detail in flight.events if kind == "phase"]
    assert phases == ["set up", "arm", "take off", "climb", "hand over", "chase"]
    assert len(flight.orders) == 5              # two streams, arm, take-off, mode
    assert flight.ground.vehicle.mode is Mode.OFFBOARD
    assert flight.ground.front.ports[0].streams.interval_ns("ATTITUDE") == 0


@pytest.mark.parametrize("seed", range(10))
def test_a_link_that_loses_four_of_ten_messages_delays_it_and_no_more(seed):
    flight = Flight(0.4, seed)

    flight.until(Phase.CHASE)

    assert flight.ground.vehicle.mode is Mode.OFFBOARD
    assert flight.ground.vehicle.armed


def test_a_vehicle_that_holds_by_itself_is_taken_back():
    flight = Flight()
    flight.until(Phase.CHASE)

    flight.ground.vehicle.mode = Mode.HOLD
    flight.until(Phase.HAND_OVER, 2.0)
    flight.until(Phase.CHASE, 2.0)

    assert flight.ground.vehicle.mode is Mode.OFFBOARD


@pytest.mark.parametrize("mode", [Mode.LAND, Mode.RETURN])
def test_a_vehicle_that_comes_down_by_itself_is_left_alone_for_ever(mode):
    flight = Flight()
    flight.until(Phase.CHASE)

    flight.ground.vehicle.mode = mode
    flight.until(Phase.OVER, 2.0)
    orders = len(flight.orders)
    flight.ground.vehicle.mode = Mode.HOLD
    flight.go_on(5.0)

    assert flight.plan.phase is Phase.OVER
    assert not flight.plan.leads
    assert len(flight.orders) == orders


def test_a_refused_order_is_told_and_given_again():
    flight = Flight()
    flight.ground.vehicle.position_valid = False
    flight.client.position_ned_m = (0.0, 0.0, 0.0)          # it had one before
    flight.until(Phase.ARM)

    flight.go_on(3.0)
    refused = flight.events.count(("order failed", "arm: temporarily rejected"))
    flight.ground.vehicle.position_valid = True
    flight.until(Phase.CHASE)

    assert 4 <= refused <= 7                    # every 0.5 s and the way there and back


def test_a_height_that_is_none_is_refused():
    with pytest.raises(ValueError, match=r"height_m=0\.0"):
        FlightPlan(Companion(MavlinkLink(245, 190)), 0.0, ())

"""The companion's end against the vehicle's front: answers, repetitions, targets."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from firmware_sim.autopilot.vehicle import Mode, PositionTarget
from firmware_sim.mavlink.companion import Companion
from firmware_sim.mavlink.enums import Command, CommandResult
from firmware_sim.mavlink.link import MavlinkLink
from tests.firmware_sim.mavlink.ground import TICK_NS, Ground

MS = 1_000_000


class Pair:
    def __init__(self):
        self.ground = Ground(quiet=False)
        self.companion = Companion(MavlinkLink(245, 190))
        self.up, self.down = (lambda frame: True), (lambda frame: True)     # which frames get through
        self.sent = []

    def run(self, seconds, *frames):
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            now_ns = self.ground.now_ns
            out = [*frames, *self.companion.step(now_ns)]
            self.sent += out
            frames = ()
            self.ground.now_ns += TICK_NS
            self.ground.vehicle.advance(self.ground.now_ns)
            for frame in self.ground.front.step([b"".join(filter(self.up, out))], self.ground.now_ns)[0]:
                if self.down(frame):
                    self.companion.hear(frame, self.ground.now_ns)


def is_ack(frame):
    return frame[7:10] == (77).to_bytes(3, "little")


def test_it_knows_what_the_vehicle_tells():
    pair = Pair()
    pair.companion.command(Command.COMPONENT_ARM_DISARM, 1)
    pair.companion.take_off()

    pair.run(3.0)

    assert pair.companion.answers == [(Command.COMPONENT_ARM_DISARM, CommandResult.ACCEPTED),
                                      (Command.NAV_TAKEOFF, CommandResult.ACCEPTED)]
    assert pair.companion.armed
    assert pair.companion.mode is Mode.HOLD
    assert pair.companion.landed_state == 2
    assert pair.companion.position_ned_m == pytest.approx((0.0, 0.0, -1.5), abs=0.06)
    assert pair.companion.quaternion_wxyz == (1.0, 0.0, 0.0, 0.0)


def test_a_lost_answer_is_asked_for_again_and_the_command_carried_out_once():
    pair = Pair()
    lost = []

    def down(frame):
        if is_ack(frame) and len(lost) < 3:
            lost.append(frame)
            return False
        return True

    pair.down = down
    pair.companion.command(Command.COMPONENT_ARM_DISARM, 1)
    pair.run(3.0)

    assert pair.companion.answers == [(Command.COMPONENT_ARM_DISARM, CommandResult.ACCEPTED)]
    assert pair.ground.vehicle.calls == ["arm False"]
    assert len(lost) == 3


def test_a_command_that_is_never_answered_is_given_up_and_the_next_one_has_its_turn():
    pair = Pair()
    pair.up = lambda frame: False
    pair.companion.command(Command.COMPONENT_ARM_DISARM, 1)
    pair.companion.command(Command.NAV_LAND)

    pair.run(7.0)

    assert pair.companion.answers == [(Command.COMPONENT_ARM_DISARM, None)]
    assert pair.companion.waits


@pytest.mark.parametrize("target", [
    PositionTarget((1.0, 2.0, -3.0)), PositionTarget((1.0, None, -3.0), (None, 0.5, None), yaw_rad=0.25),
    PositionTarget(velocity_ned_mps=(0.0, 0.0, -1.0), yaw_rate_radps=0.5), PositionTarget(yaw_rad=0.0)])
def test_a_target_arrives_as_it_was_meant(target):
    pair = Pair()

    pair.run(0.01, pair.companion.target(target, 0))

    assert pair.ground.vehicle.targets == [target]


def test_an_order_is_sent_again_with_a_growing_confirmation_as_others_read_it():
    companion, mav = Companion(MavlinkLink(245, 190), again_ns=500 * MS, most_tries=4), common.MAVLink(None)
    companion.command(Command.COMPONENT_ARM_DISARM, 1)

    found = [(now_ns, message) for now_ns in range(0, 3_000 * MS, 100 * MS) for frame in companion.step(now_ns)
             for message in mav.parse_buffer(frame) if message.get_type() == "COMMAND_LONG"]

    assert [(now_ns, message.confirmation) for now_ns, message in found] == [(k * 500 * MS, k) for k in range(4)]
    assert {(message.command, message.param1, message.target_system) for _, message in found} == {(400, 1.0, 1)}


def test_a_position_that_is_no_place_is_none():
    companion, mav = Companion(MavlinkLink(245, 190)), common.MAVLink(None, srcSystem=1, srcComponent=1)

    companion.hear(mav.local_position_ned_encode(0, 1.0, float("nan"), -3.0, 0, 0, 0).pack(mav), 20)

    assert companion.position_ned_m is None
    assert companion.link.counts["positions that are not finite"] == 1


@given(st.lists(st.binary(max_size=200), max_size=8))
def test_any_bytes_at_all_change_nothing(chunks):
    companion = Companion(MavlinkLink(245, 190))
    companion.command(Command.COMPONENT_ARM_DISARM, 1)
    companion.step(0)

    for k, chunk in enumerate(chunks):
        companion.hear(chunk, k)

    assert companion.waits
    assert (companion.armed, companion.mode, companion.position_ned_m, companion.answers) == (False, None, None, [])


def test_others_are_not_taken_for_the_vehicle():
    companion = Companion(MavlinkLink(245, 190))
    other = Ground(quiet=False, system=1)
    other.front.ports[0].link.system = 9

    for frame in other.front.step([b""], 0)[0]:
        assert companion.hear(frame, 0) == []
    assert companion.mode is None

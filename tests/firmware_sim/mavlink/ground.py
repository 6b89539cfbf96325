"""A ground station of pymavlink's own encoder and parser, in front of a MAVLink front with the stand-in vehicle."""

from __future__ import annotations

from pymavlink.dialects.v20 import common

from firmware_sim.mavlink.front import MavlinkFront
from firmware_sim.mavlink.settings import STREAMS_HZ, MavlinkSettings
from tests.firmware_sim.mavlink import kinematic_vehicle as kinematic

TICK_NS = 5_000_000
QUIET = dict.fromkeys(STREAMS_HZ, 0.0)


class Ground:
    """`say(message)` hands a message over and runs one tick; everything heard is in `heard`, in order."""

    def __init__(self, quiet=True, system=255, vehicle=None, **settings):
        self.vehicle = vehicle or kinematic.KinematicVehicle()
        self.events = []
        settings.setdefault("streams_hz", QUIET if quiet else {})
        self.front = MavlinkFront(self.vehicle, MavlinkSettings(**settings),
                                  lambda kind, detail: self.events.append((kind, detail)))
        self.vehicle.on_notice = lambda severity, text: self.front.say(severity, text, self.told_ns)
        self.mav = common.MAVLink(None, srcSystem=system, srcComponent=190)
        self.mav.robust_parsing = True
        self.now_ns = self.told_ns = 0
        self.heard = []         # (time_ns, message)

    def pack(self, message):
        data = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        return data

    def say(self, *messages):
        """What comes back at once."""
        return self.tick(b"".join(map(self.pack, messages)))

    def tick(self, data=b""):
        self.now_ns += TICK_NS
        self.vehicle.advance(self.now_ns)
        answers = []
        self.told_ns = self.now_ns
        for frame in self.front.step([data], self.now_ns)[0]:
            answers += self.mav.parse_buffer(frame) or []
        self.heard += [(self.now_ns, message) for message in answers]
        return answers

    def run(self, seconds):
        before = len(self.heard)
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            self.tick()
        return [message for _, message in self.heard[before:]]

    def until(self, wanted, seconds=60.0):
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            if wanted():
                return
            self.tick()
        raise AssertionError(f"not within {seconds} s")

    # --- commands

    def command(self, number, *parameters, confirmation=0):
        """(result, everything that came with it)"""
        padded = (*parameters, *(0.0,) * (7 - len(parameters)))
        answers = self.say(self.mav.command_long_encode(1, 1, number, confirmation, *padded))
        (ack,) = [answer for answer in answers if answer.get_type() == "COMMAND_ACK"]
        assert ack.command == number
        assert (ack.target_system, ack.target_component) == (255, 190)
        return ack.result, [answer for answer in answers if answer is not ack]

    def fly_up(self, height_m=2.0):
        self.command(common.MAV_CMD_COMPONENT_ARM_DISARM, 1)
        self.command(common.MAV_CMD_NAV_TAKEOFF, *[float("nan")] * 6, 488.0 + height_m)
        self.until(lambda: self.vehicle.mode is kinematic.Mode.HOLD)


def kinds(messages):
    return [message.get_type() for message in messages]

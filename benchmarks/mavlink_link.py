"""Measures MAVLink: frames read and built per second, and a front that serves its link 200 times a second."""

from __future__ import annotations

import time
from collections.abc import Callable

from firmware_sim.autopilot.airframe import Airframe
from firmware_sim.autopilot.flight_controller import FlightController
from firmware_sim.mavlink.dialect import message
from firmware_sim.mavlink.front import MavlinkFront
from firmware_sim.mavlink.link import MavlinkLink
from firmware_sim.mavlink.settings import MavlinkSettings

FRAMES = 20_000
STEPS = 20_000
PERIOD_NS = 5_000_000


def per_second(count: int, work: Callable[[], object]) -> float:
    began_s = time.perf_counter()
    work()
    return count / (time.perf_counter() - began_s)


def main() -> None:
    sender, receiver = MavlinkLink(255, 190), MavlinkLink(1, 1)
    told = message("SET_POSITION_TARGET_LOCAL_NED", time_boot_ms=1, coordinate_frame=1, type_mask=0xDF8, x=1.0, y=2.0,
                   z=-3.0, target_system=1, target_component=1)
    built: list[bytes] = []
    rate = per_second(FRAMES, lambda: built.extend(sender.send(told, 0) for _ in range(FRAMES)))
    print(f"built       {rate:10.0f} frames a second, of {len(built[0])} bytes")
    stream = b"".join(built)
    rate = per_second(FRAMES, lambda: [receiver.receive(stream[at:at + 1000], 0) for at in range(0, len(stream), 1000)])
    print(f"read        {rate:10.0f} frames a second ({receiver.counts['frames taken']} taken)")
    front = MavlinkFront(FlightController(Airframe(), 1_000_000, 10), MavlinkSettings())
    rate = per_second(STEPS, lambda: [front.step([b""], k * PERIOD_NS) for k in range(STEPS)])
    print(f"front       {1e6 / rate:10.1f} us a step at default rates, {rate * PERIOD_NS * 1e-9:.0f} x real time")


if __name__ == "__main__":
    main()

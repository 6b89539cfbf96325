"""The ground computer of a flying pursuer: it decides when to look, and sends waypoints over MAVLink.

    instant k T_s        read the frames from link and camera; decide by Figure 3.3: look at k + 1? which waypoint?
      + execution_ns     send the look, the waypoint, commands and heartbeat

A waypoint is the newest detection or, if that was in the no-moving area, the vehicle's place at that time. A new
waypoint is sent at once and repeated every `resend_every` instants: OFFBOARD needs a stream, and the link may lose
frames. Height and heading are constant. The autopilot's ramp takes the place of the law (3.6): near a waypoint its
speed is K times the distance, K = `gain_per_s`, farther away `speed_mps`; the theorem's conditions are checked with
these.

`response_ns` is a delay that the theorem does not contain: the waypoint's way to the vehicle, the vehicle's inertia,
and the age of its known place. The escape area must allow for it as for late detections (section 3.5: 15 T_s v_max "to
accommodate ... the latency in the link").

Places are in the room's frame, x east and y north, headings from x to y; MAVLink has north, east, down and clockwise.
Not modelled: a camera on board; the room's cameras detect, as in section 3.5 ("to emulate on-board sensors").
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from math import nan, pi, remainder
from typing import Any, Final

from simpy.events import Event

from agents.pursuit import Place
from agents.pursuit.aerial_settings import AerialSettings
from agents.pursuit.detections import take_in
from agents.pursuit.flight_plan import FlightPlan, Phase
from agents.pursuit.pursuer_check import view_problems
from firmware_sim.autopilot.vehicle import PositionTarget
from firmware_sim.board import Board
from firmware_sim.mavlink.companion import Companion
from firmware_sim.mavlink.counters import COMPANION_COUNTERS, BoardCounters
from firmware_sim.mavlink.link import MavlinkLink
from firmware_sim.scenario_view import Own, ScenarioView
from firmware_sim.schedules.periodic import Periodic
from netem.media.sensing.sight import LOOK, NothingSeen, unpack_sight

SYSTEM, COMPONENT = 245, 191         # MAV_COMP_ID_ONBOARD_COMPUTER
PHASES: Final = {phase: float(number) for number, phase in enumerate(Phase)}
SIGNALS: Final = (("estimate_x", "m"), ("estimate_y", "m"), ("detection_x", "m"), ("detection_y", "m"),
                  ("waypoint_x", "m"), ("waypoint_y", "m"), ("heard_east", "m"), ("heard_north", "m"), ("phase", "1"))

COUNTERS: Final = ("looks", "looks that saw nothing", "detections", "detections refused", "detections too late",
                   "waypoints sent", "unreadable frames")


@dataclass(frozen=True)
class CompanionSettings:
    target: str                         # name of the agent that the vehicle follows
    pursuit: AerialSettings
    view: str = "view"                  # name of the port on the sensing medium
    link: str = "link"                  # name of the port on the line to the vehicle


class AerialCompanion:
    Settings = CompanionSettings
    has_execution_time = True

    def __init__(self, board: Board, own: CompanionSettings) -> None:
        self._settings = settings = own.pursuit
        self._board, self._target = board, own.target
        self._pursuer = settings.pursuer(board.rng)
        self._vehicle = Companion(MavlinkLink(SYSTEM, COMPONENT), again_ns=settings.retry_ns)
        self._plan = FlightPlan(self._vehicle, settings.height_m, (
            ("LOCAL_POSITION_NED", settings.position_every_ns), ("ATTITUDE", settings.attitude_every_ns)), board.event,
            board.warn)
        self._view = board.port(own.view, self._see, listen_only=True)
        self._link = board.port(own.link, self._hear, listen_only=True)
        self._schedule = Periodic(settings.step_ns, settings.offset_ns)
        self._yaw_rad = remainder(pi / 2 - settings.heading_rad, 2 * pi)
        self._heard = bytearray()
        self._seen: list[tuple[int, Place]] = []
        self._newest: Place = nan, nan              # the newest detection
        self._waypoint: Place | None = None
        self._in_view = False                       # whether the last look detected the target
        self._due = 0                               # number of the instant at which the waypoint is sent again
        for counter in COUNTERS:
            board.count(counter, 0)
        self._counters = BoardCounters(board, COMPANION_COUNTERS)
        board.record_all(SIGNALS, self._sample)

    @staticmethod
    def check(scenario: ScenarioView, own: Own[CompanionSettings]) -> Iterator[str]:
        """Yield one problem for each missing port and each setting that contradicts the sensing medium."""
        for name, agent in own.items():
            settings = agent.settings
            for key, port in (("view", settings.view), ("link", settings.link)):
                if port not in agent.media:
                    yield (f"agents.{name}.parameters.{key}={port}: no such port; it is on "
                           f"{', '.join(agent.media) or 'no medium'}")
            if (view := scenario.media.get(settings.view)) is not None:
                yield from (f"agents.{name}.parameters.pursuit: {line}"
                            for line in view_problems(settings.pursuit, name, settings.view, view))

    # --- receive

    def _hear(self, data: bytes) -> None:
        self._heard += data

    def _see(self, data: bytes) -> None:
        sight = unpack_sight(data)
        if sight is None:
            self._board.count("unreadable frames")
        elif isinstance(sight, NothingSeen):
            self._board.count("looks that saw nothing")
            if self._in_view:
                self._board.warn("nothing in view", f"in the exposure of {sight.exposed_ns * 1e-9:.3f} s")
            self._in_view = False
        elif sight.name == self._target:
            self._in_view = True
            self._seen.append((sight.exposed_ns, (sight.x_m, sight.y_m)))

    # --- the program

    def run(self) -> Generator[Event, Any, None]:
        board = self._board
        release_ns, instant = self._schedule.next_after(board.now_ns - 1), 0
        while True:
            yield from board.sleep_until(release_ns, silent_until_ns=release_ns + self._settings.execution_ns)
            look, frames = self._step(board.now_ns, instant)
            yield from board.sleep_until(release_ns + board.execution_ns(self._settings.execution_ns))
            if look:
                board.count("looks")
                self._view.send(LOOK)
            for frame in frames:
                self._link.send(frame)
            release_ns, instant = self._schedule.next_after(board.now_ns), instant + 1

    def _step(self, now_ns: int, instant: int) -> tuple[bool, list[bytes]]:
        """Return whether to look at the next instant, and the frames to send over the link."""
        vehicle, plan, pursuer = self._vehicle, self._plan, self._pursuer
        vehicle.hear(bytes(self._heard), now_ns)
        self._heard.clear()
        while vehicle.texts:
            self._board.event("vehicle says", vehicle.texts.pop(0))
        plan.step(now_ns)
        own = self._own()
        if self._waypoint is None and plan.leads:
            self._move_to(own)
        for seen_ns, seen in sorted(self._seen):
            if take_in(self._board, pursuer, seen_ns, seen, own):
                self._newest = seen
                self._move_to(pursuer.goal or own)
        self._seen.clear()
        look = False
        if plan.phase is Phase.CHASE:
            next_ns = self._schedule.next_after(now_ns)
            look = pursuer.step(now_ns, own).look_ns <= next_ns
            if look:
                pursuer.asked(next_ns)
        frames = vehicle.step(now_ns)
        if plan.leads and self._waypoint is not None and instant >= self._due:
            x, y = self._waypoint
            place = PositionTarget((y, x, -self._settings.height_m), yaw_rad=self._yaw_rad)
            frames.append(vehicle.target(place, now_ns))
            self._due = instant + self._settings.resend_every
            self._board.count("waypoints sent")
        self._counters.note(vehicle.link.counts)
        return look, frames

    def _move_to(self, place: Place) -> None:
        self._waypoint, self._due = place, 0

    def _own(self) -> Place:
        """Return the place that the vehicle reported last; on its way to a detection it is nearer to it by now."""
        north, east, _ = self._vehicle.position_ned_m or (0.0, 0.0, 0.0)
        return east, north

    # --- counters and samples

    def _sample(self) -> list[float]:
        now_ns = self._board.now_ns
        own = self._own()
        seen_ns = self._pursuer.seen_ns
        estimate = (nan, nan) if seen_ns is None else self._pursuer.estimator.expect(max(now_ns, seen_ns))
        return [*estimate, *self._newest, *(self._waypoint or own), *own, PHASES[self._plan.phase]]

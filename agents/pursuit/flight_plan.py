"""The phases of a flying pursuer's flight, and the commands that the ground sends in each over MAVLink.

    CONNECT --heartbeat, position--> SET_UP --streams--> ARM --> TAKE_OFF --> CLIMB --holds at its height--> HAND_OVER
    HAND_OVER --OFFBOARD accepted--> CHASE --it says HOLD--> HAND_OVER          anything in the air --it lands--> OVER

Each arrow is an acknowledged command, repeated while it is refused or unanswered. If a failsafe takes the vehicle out
of OFFBOARD, the plan does not interrupt it: it requests OFFBOARD again only when the vehicle holds, never while it
lands. The take-off climbs to the parameter MIS_TAKEOFF_ALT; the position targets then set the height.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from firmware_sim.autopilot.vehicle import Mode
from firmware_sim.mavlink.companion import Companion
from firmware_sim.mavlink.dialect import layout_of
from firmware_sim.mavlink.enums import Command, CommandResult

US_NS: Final = 1_000
AGAIN_NS: Final = 500_000_000       # from a refusal, or a command without an answer, until it is repeated
STREAM_NS: Final = 300_000_000      # for which targets are sent before OFFBOARD is requested
LOW_SHARE: Final = 0.8              # share of the height that ends the climb


class Phase(Enum):
    CONNECT = "connect"
    SET_UP = "set up"
    ARM = "arm"
    TAKE_OFF = "take off"
    CLIMB = "climb"
    HAND_OVER = "hand over"
    CHASE = "chase"
    OVER = "over"


IN_THE_AIR: Final = (Phase.CLIMB, Phase.HAND_OVER, Phase.CHASE)
ACCEPTED: Final = {Phase.ARM: Phase.TAKE_OFF, Phase.TAKE_OFF: Phase.CLIMB, Phase.HAND_OVER: Phase.CHASE}


@dataclass
class FlightPlan:
    link: Companion
    height_m: float
    streams_ns: Sequence[tuple[str, int]]           # (message, its interval); 0: not sent
    event: Callable[[str, str], None] = lambda kind, detail: None
    warn: Callable[[str, str], None] = lambda kind, detail: None
    phase: Phase = field(default=Phase.CONNECT, init=False)
    _since_ns: int = field(default=0, init=False)   # start of the phase
    _waits_ns: int = field(default=0, init=False)   # no command is sent before
    _set_up: int = field(default=0, init=False)     # number of streams set up

    def __post_init__(self) -> None:
        if not self.height_m > 0:
            raise ValueError(f"height_m={self.height_m}: expected more than 0")

    @property
    def leads(self) -> bool:
        """Whether the ground has to send targets to the vehicle in this phase."""
        return self.phase in (Phase.HAND_OVER, Phase.CHASE)

    def step(self, now_ns: int) -> None:
        """Advance the plan with the messages received until `now_ns`; send the next command if one is due."""
        while self.link.answers:
            self._answered(self.link.answers.pop(0)[1], now_ns)
        self._look(now_ns)
        if not self.link.waits and now_ns >= self._waits_ns:
            self._ask()

    def _look(self, now_ns: int) -> None:
        """Change the phase according to the vehicle's reported state."""
        told, phase = self.link, self.phase
        if phase is Phase.CONNECT and told.heartbeat_ns >= 0 and told.position_ned_m is not None:
            self._enter(Phase.SET_UP, now_ns)
        if told.heartbeat_ns <= self._since_ns:
            return
        if phase in IN_THE_AIR and (not told.armed or told.mode in (Mode.LAND, Mode.RETURN)):
            self._enter(Phase.OVER, now_ns, "disarmed" if not told.armed else f"it says {told.mode}")
        elif phase is Phase.TAKE_OFF and not told.armed and not told.waits:
            self._enter(Phase.ARM, now_ns, "disarmed")
        elif phase is Phase.CLIMB and told.mode is Mode.HOLD and self._is_up():
            self._enter(Phase.HAND_OVER, now_ns)
            self._waits_ns = now_ns + STREAM_NS
        elif phase is Phase.CHASE and told.mode is not Mode.OFFBOARD:
            self._enter(Phase.HAND_OVER, now_ns, "it left OFFBOARD by itself")

    def _is_up(self) -> bool:
        place = self.link.position_ned_m
        return place is not None and -place[2] > LOW_SHARE * self.height_m

    def _ask(self) -> None:
        link, phase = self.link, self.phase
        if phase is Phase.SET_UP:
            name, interval_ns = self.streams_ns[self._set_up]
            link.command(Command.SET_MESSAGE_INTERVAL, layout_of(name).id, interval_ns // US_NS if interval_ns else -1)
        elif phase is Phase.ARM:
            link.command(Command.COMPONENT_ARM_DISARM, 1.0)
        elif phase is Phase.TAKE_OFF:
            link.take_off()
        elif phase is Phase.HAND_OVER:
            link.set_mode(Mode.OFFBOARD)

    def _answered(self, result: CommandResult | None, now_ns: int) -> None:
        phase = self.phase
        if result is not CommandResult.ACCEPTED:
            said = "unanswered" if result is None else result.name.lower().replace("_", " ")
            self.warn("order failed", f"{phase.value}: {said}")
            self._waits_ns = now_ns + AGAIN_NS
        elif phase is Phase.SET_UP:
            self._set_up += 1
            if self._set_up == len(self.streams_ns):
                self._enter(Phase.ARM, now_ns)
        elif phase in ACCEPTED:
            self._enter(ACCEPTED[phase], now_ns)

    def _enter(self, phase: Phase, now_ns: int, why: str = "") -> None:
        self.event("phase", f"{phase.value}: {why}" if why else phase.value)
        self.phase, self._since_ns, self._waits_ns = phase, now_ns, now_ns

"""Round-robin slots on the local clock: who may speak when (TDMA).

    slot k = [start + k slot, start + (k+1) slot), belongs to part k mod T;  round m = slots m T .. m T + T - 1

    | guard |  data  | guard |  control  | guard |       without control sub-slots: | guard |  data  | guard |
    0       data          control_offset         slot

The agents of part k mod T begin to send at start + k slot + guard. If the frames fit, clocks that differ from each
other by up to the guard never make them overlap; without control sub-slots there are two guards between frames, so
the clocks may differ by twice the guard. In the control sub-slot of slot k one agent alone may speak, agent k mod N in
cycle floor(k / N), so it collides with nobody, whatever the graph: topology discovery uses it.

Source: Protocol 1 of the dissertation, Chapter 6.
Differs from the dissertation: `mod N` there is `mod T`, T the number of nonempty parts; with mod N the slots of
N - T parts stay idle.
Not modelled: slots of unequal length, several slots of a part in one round.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple


class SlotTooShort(ValueError):
    """A frame and its guard times do not fit into their slot."""


class Slot(NamedTuple):
    number: int                 # k, counted from 0 at the schedule's start; negative before it: nobody speaks there
    part: int                   # 0 <= part < T
    start_ns: int               # local; the slot is [start, start + slot)


@dataclass(frozen=True)
class SlottedBroadcast:
    """All times are local times; what is next lies strictly after the time asked for.

    - A schedule that starts at local time 0 without a guard has its first slot at 0: `next_slot_of(part, -1)`.
    - A sender picks its slot, waits for it and then uses that slot's number. It does not ask again on waking: a clock
      that is fast or shows ticks may read a little more than the instant waited for.
    """

    parts: int                              # T
    slot_ns: int
    start_ns: int = 0
    guard_ns: int = 0
    agents: int = 0                         # N owners of control sub-slots, 0: there are none
    control_offset_ns: int | None = None    # start of the control transmission within its slot

    def __post_init__(self) -> None:
        if self.parts < 1:
            raise ValueError(f"parts={self.parts}: a round has at least 1 part")
        if self.guard_ns < 0:
            raise ValueError(f"guard_ns={self.guard_ns}: expected 0 or more")
        if self.slot_ns <= 2 * self.guard_ns:
            raise ValueError(f"slot_ns={self.slot_ns}: expected more than two guard times ({2 * self.guard_ns})")
        if (self.agents > 0) != (self.control_offset_ns is not None) or self.agents < 0:
            raise ValueError(f"agents={self.agents}, control_offset_ns={self.control_offset_ns}: "
                             "control sub-slots need both, at least 1 agent and an offset")
        if self.control_offset_ns is not None and not (
                2 * self.guard_ns < self.control_offset_ns < self.slot_ns - self.guard_ns):
            raise ValueError(f"control_offset_ns={self.control_offset_ns}: expected 2 guard < offset < slot - guard "
                             f"({2 * self.guard_ns} to {self.slot_ns - self.guard_ns})")

    @property
    def round_ns(self) -> int:
        return self.parts * self.slot_ns

    # --- slots

    def slot(self, number: int) -> Slot:
        return Slot(number, number % self.parts, self.start_ns + number * self.slot_ns)

    def slot_at(self, local_ns: int) -> Slot:
        """The slot that holds `local_ns`; its number is negative before the start."""
        return self.slot((local_ns - self.start_ns) // self.slot_ns)

    def data_ns(self, number: int) -> int:
        """When the part of slot `number` begins to send."""
        return self.start_ns + number * self.slot_ns + self.guard_ns

    def next_after(self, now_ns: int) -> int:
        """The next instant at which any part begins to send."""
        return self.data_ns(self._first_after(now_ns, self.guard_ns))

    def next_slot_of(self, part: int, local_ns: int, after_slot: int = -1) -> Slot:
        """The first slot of `part` that begins to send strictly after `local_ns` and comes after slot `after_slot`.

        A sender gives the slot in which it spoke last as `after_slot`: a clock that was set back then does not make
        it speak twice.
        """
        if not 0 <= part < self.parts:
            raise ValueError(f"part={part}: expected 0 <= part < {self.parts}")
        earliest = max(self._first_after(local_ns, self.guard_ns), after_slot + 1)
        return self.slot(earliest + (part - earliest) % self.parts)

    def nearest_slot_of(self, part: int, sent_ns: int) -> Slot:
        """The slot of `part` whose sending instant is nearest to `sent_ns` (the earlier one of two)."""
        rounds = (sent_ns - self.data_ns(part) + (self.round_ns - 1) // 2) // self.round_ns
        return self.slot(max(0, rounds) * self.parts + part)

    def of_part(self, part: int) -> PartSlots:
        """The instants of one part as a schedule of its own."""
        return PartSlots(self, part)

    # --- control sub-slots

    def control_owner(self, number: int) -> int:
        """The agent that may use the control sub-slot of slot `number`, 0 <= agent < N."""
        self._control_offset()
        return number % self.agents

    def control_cycle(self, number: int) -> int:
        """How many times every agent had its control sub-slot before the cycle of slot `number`."""
        self._control_offset()
        return number // self.agents

    def control_ns(self, number: int) -> int:
        """When the owner of the control sub-slot of slot `number` begins to send."""
        return self.start_ns + number * self.slot_ns + self._control_offset()

    def next_control_of(self, agent: int, local_ns: int, after_slot: int = -1) -> Slot:
        """The first slot whose control sub-slot is `agent`'s, begins strictly after `local_ns`, after `after_slot`."""
        offset_ns = self._control_offset()
        if not 0 <= agent < self.agents:
            raise ValueError(f"agent={agent}: expected 0 <= agent < {self.agents}")
        earliest = max(self._first_after(local_ns, offset_ns), after_slot + 1)
        return self.slot(earliest + (agent - earliest) % self.agents)

    def control_of(self, agent: int) -> ControlSlots:
        """The control instants of one agent as a schedule of its own."""
        return ControlSlots(self, agent)

    # --- rounds

    def round_end_after(self, local_ns: int) -> int:
        """The first end of a complete round strictly after `local_ns`; the start counts as one."""
        rounds = max(0, (local_ns - self.start_ns) // self.round_ns + 1)
        return self.start_ns + rounds * self.round_ns

    def restart(self, at_local_ns: int, parts: int, slot_ns: int,
                control_offset_ns: int | None = None) -> SlottedBroadcast:
        """The schedule that takes over at the first complete round's end after `at_local_ns`, counting from slot 0."""
        return replace(self, parts=parts, slot_ns=slot_ns, start_ns=self.round_end_after(at_local_ns),
                       control_offset_ns=self.control_offset_ns if control_offset_ns is None else control_offset_ns)

    def fits(self, airtime_ns: int, control_airtime_ns: int = 0) -> None:
        """Raise `SlotTooShort` unless frames of these airtimes, with a guard before and after each, fit."""
        room_ns = self.slot_ns if self.control_offset_ns is None else self.control_offset_ns
        _fits("data", 2 * self.guard_ns + airtime_ns, room_ns, self.guard_ns, airtime_ns, "slot_ns"
              if self.control_offset_ns is None else "control_offset_ns")
        if self.control_offset_ns is not None:
            _fits("control", self.control_offset_ns + control_airtime_ns + self.guard_ns, self.slot_ns, self.guard_ns,
                  control_airtime_ns, "slot_ns")

    def _first_after(self, local_ns: int, offset_ns: int) -> int:
        """Smallest k >= 0 with start + k slot + offset > local."""
        return max(0, (local_ns - self.start_ns - offset_ns) // self.slot_ns + 1)

    def _control_offset(self) -> int:
        if self.control_offset_ns is None:
            raise ValueError("this schedule has no control sub-slots: give agents and control_offset_ns")
        return self.control_offset_ns


def _fits(what: str, needed_ns: int, room_ns: int, guard_ns: int, airtime_ns: int, key: str) -> None:
    if needed_ns > room_ns:
        raise SlotTooShort(f"{key}={room_ns}: a {what} frame of {airtime_ns} ns with its guard times of {guard_ns} ns "
                           f"needs {needed_ns} ns: lengthen it by {needed_ns - room_ns} ns or shorten frame or guard")


@dataclass(frozen=True)
class PartSlots:
    """When one part begins to send."""

    schedule: SlottedBroadcast
    part: int

    def __post_init__(self) -> None:
        self.schedule.next_slot_of(self.part, 0)

    def next_after(self, now_ns: int) -> int:
        return self.schedule.data_ns(self.schedule.next_slot_of(self.part, now_ns).number)


@dataclass(frozen=True)
class ControlSlots:
    """When one agent begins to send in its control sub-slots."""

    schedule: SlottedBroadcast
    agent: int

    def __post_init__(self) -> None:
        self.schedule.next_control_of(self.agent, 0)

    def next_after(self, now_ns: int) -> int:
        return self.schedule.control_ns(self.schedule.next_control_of(self.agent, now_ns).number)

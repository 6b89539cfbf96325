"""Round-robin slots on the local clock, in which agents may send (TDMA).

    slot k = [start + k slot, start + (k+1) slot), belongs to part k mod T;  round m = slots m T .. m T + T - 1

    | guard |  data  | guard |  control  | guard |       without control sub-slots: | guard |  data  | guard |
    0       data          control_offset         slot

The agents of part k mod T begin to send at start + k slot + guard. If the frames fit, they do not overlap as long as
clocks differ from each other by at most the guard; without control sub-slots there are two guards between frames, so
the clocks may differ by twice the guard. In the control sub-slot of slot k only agent k mod N may send, in cycle
floor(k / N), so its frame collides with no other, whatever the graph; topology discovery uses it.

Source: Protocol 1 of the dissertation, Chapter 6.
Differs from the dissertation: `mod N` there is `mod T`, T the number of nonempty parts; with mod N the slots of
N - T parts stay idle.
Not modelled: slots of unequal length, several slots of a part in one round.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class SlotTooShort(ValueError):
    """A frame and its guard times do not fit into their slot."""


class Slot(NamedTuple):
    number: int                 # k, counted from 0 at the schedule's start; negative before it, where no agent sends
    part: int                   # 0 <= part < T
    start_ns: int               # local time; the slot is [start, start + slot)


@dataclass(frozen=True)
class SlottedBroadcast:
    """All times are local; a next instant is strictly after the given one.

    - To get a first slot at local time 0 (start and guard 0), call `next_slot_of(part, -1)`.
    - A sender gets its slot, waits for it and then uses that slot's number. It does not get a slot anew on waking: a
      clock that is fast or has ticks may read a little more than the instant it waited for.
    """

    parts: int                              # T
    slot_ns: int
    start_ns: int = 0
    guard_ns: int = 0
    agents: int = 0                         # N, owners of control sub-slots; 0: no control sub-slots
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
        """Return the slot that contains `local_ns`; its number is negative before the start."""
        return self.slot((local_ns - self.start_ns) // self.slot_ns)

    def data_ns(self, number: int) -> int:
        """Return the instant at which the part of slot `number` begins to send."""
        return self.start_ns + number * self.slot_ns + self.guard_ns

    def next_after(self, now_ns: int) -> int:
        """Return the next instant at which any part begins to send."""
        return self.data_ns(self._first_after(now_ns, self.guard_ns))

    def next_slot_of(self, part: int, local_ns: int, after_slot: int = -1) -> Slot:
        """Return the first slot of `part` after slot `after_slot` that begins to send strictly after `local_ns`.

        A sender gives its last slot as `after_slot`, so that it does not send twice if its clock was set back.
        """
        if not 0 <= part < self.parts:
            raise ValueError(f"part={part}: expected 0 <= part < {self.parts}")
        earliest = max(self._first_after(local_ns, self.guard_ns), after_slot + 1)
        return self.slot(earliest + (part - earliest) % self.parts)

    def nearest_slot_of(self, part: int, sent_ns: int) -> Slot:
        """Return the slot of `part` whose sending instant is nearest to `sent_ns` (the earlier one of two)."""
        rounds = (sent_ns - self.data_ns(part) + (self.round_ns - 1) // 2) // self.round_ns
        return self.slot(max(0, rounds) * self.parts + part)

    # --- control sub-slots

    def control_owner(self, number: int) -> int:
        """Return the agent that may use the control sub-slot of slot `number`, 0 <= agent < N."""
        self._control_offset()
        return number % self.agents

    def control_cycle(self, number: int) -> int:
        """Return the control cycle of slot `number`: in each cycle every agent has one control sub-slot."""
        self._control_offset()
        return number // self.agents

    def control_ns(self, number: int) -> int:
        """Return the instant at which the owner of the control sub-slot of slot `number` begins to send."""
        return self.start_ns + number * self.slot_ns + self._control_offset()

    def next_control_of(self, agent: int, local_ns: int, after_slot: int = -1) -> Slot:
        """Return the first slot after `after_slot` whose control sub-slot is `agent`'s and begins after `local_ns`."""
        offset_ns = self._control_offset()
        if not 0 <= agent < self.agents:
            raise ValueError(f"agent={agent}: expected 0 <= agent < {self.agents}")
        earliest = max(self._first_after(local_ns, offset_ns), after_slot + 1)
        return self.slot(earliest + (agent - earliest) % self.agents)

    # --- rounds

    def round_end_after(self, local_ns: int) -> int:
        """Return the first end of a complete round strictly after `local_ns`; the start counts as one."""
        rounds = max(0, (local_ns - self.start_ns) // self.round_ns + 1)
        return self.start_ns + rounds * self.round_ns

    def fits(self, airtime_ns: int, control_airtime_ns: int = 0) -> None:
        """Raise `SlotTooShort` unless frames of these airtimes, with a guard before and after each, fit."""
        room_ns = self.slot_ns if self.control_offset_ns is None else self.control_offset_ns
        _fits("data", 2 * self.guard_ns + airtime_ns, room_ns, self.guard_ns, airtime_ns, "slot_ns"
              if self.control_offset_ns is None else "control_offset_ns")
        if self.control_offset_ns is not None:
            _fits("control", self.control_offset_ns + control_airtime_ns + self.guard_ns, self.slot_ns, self.guard_ns,
                  control_airtime_ns, "slot_ns")

    def _first_after(self, local_ns: int, offset_ns: int) -> int:
        """Return the smallest k >= 0 with start + k slot + offset > local."""
        return max(0, (local_ns - self.start_ns - offset_ns) // self.slot_ns + 1)

    def _control_offset(self) -> int:
        if self.control_offset_ns is None:
            raise ValueError("this schedule has no control sub-slots: give agents and control_offset_ns")
        return self.control_offset_ns


def _fits(what: str, needed_ns: int, room_ns: int, guard_ns: int, airtime_ns: int, key: str) -> None:
    if needed_ns > room_ns:
        raise SlotTooShort(f"{key}={room_ns}: a {what} frame of {airtime_ns} ns with its guard times of {guard_ns} ns "
                           f"needs {needed_ns} ns: lengthen it by {needed_ns - room_ns} ns or shorten frame or guard")

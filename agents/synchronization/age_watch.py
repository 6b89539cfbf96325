"""The age of the values that a robot receives, checked against the assumption of its slots: each arrives within one
slot, or within the delay with which the exact loop is stable (`delayed_loop`).

    age = time of arrival - sending instant of the slot whose number the frame bears, both by the receiver's clock

Slot numbers begin anew with each topology. So the robot searches the frame's slot in the schedule in force and then in
the earlier ones, the latest first. A slot fits if it belonged to the sender, lay within the time in which its schedule
was in force, and gives an age that the links can cause. The first fit gives the age, which is thus never too great.

The first value of a sender that is too old is reported, and again each time that the age has doubled, so that a growing
queue is reported a few times and not at every frame.

Not modelled: the age of a value whose sender counts slots by a schedule that this robot never had.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from firmware_sim.schedules.slotted_broadcast import SlottedBroadcast

REMEMBERED: Final = 32                  # number of earlier schedules kept


@dataclass(frozen=True)
class _Era:
    schedule: SlottedBroadcast
    part_of: Mapping[int, int]          # robot -> part
    from_ns: int                        # local time, as `until_ns`
    until_ns: int                       # a slot that begins then or later belongs to the next schedule


class AgeWatch:
    """`oldest_ns`: the greatest age that a value can have on arrival; negative: unknown."""

    def __init__(self, oldest_ns: int, tolerance_ns: int) -> None:
        self._oldest_ns = oldest_ns
        self._tolerance_ns = tolerance_ns       # largest difference of two robots' clocks
        self._eras: deque[_Era] = deque(maxlen=REMEMBERED)      # the latest first
        self._reported_ns: dict[int, int] = {}

    def retire(self, schedule: SlottedBroadcast, part_of: Mapping[int, int], from_ns: int, until_ns: int) -> None:
        """Keep `schedule`, which was in force over [from_ns, until_ns), local time."""
        self._eras.appendleft(_Era(schedule, dict(part_of), from_ns, until_ns))

    def forget(self) -> None:
        """Drop the earlier schedules: the robots may have used different ones."""
        self._eras.clear()

    def age_ns(self, sender: int, slot: int, now_ns: int, schedule: SlottedBroadcast, part_of: Mapping[int, int],
               from_ns: int) -> int | None:
        """Return the age [ns] of a value of `sender` that bears this slot number; None if no schedule fits."""
        for era in (_Era(schedule, part_of, from_ns, now_ns + self._tolerance_ns + 1), *self._eras):
            sent_ns = era.schedule.data_ns(slot)
            age_ns = now_ns - sent_ns
            if slot % era.schedule.parts != era.part_of.get(sender) or age_ns < -self._tolerance_ns:
                continue
            if not era.from_ns - self._tolerance_ns <= sent_ns < era.until_ns:
                continue
            if self._oldest_ns < 0 or age_ns <= self._oldest_ns + self._tolerance_ns:
                return age_ns
        return None

    def is_news(self, sender: int, age_ns: int) -> bool:
        """Return whether to report this age: the sender's first that is too old, or twice the one reported last."""
        reported_ns = self._reported_ns.get(sender)
        if reported_ns is not None and age_ns < 2 * reported_ns:
            return False
        self._reported_ns[sender] = age_ns
        return True

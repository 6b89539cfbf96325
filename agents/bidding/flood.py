"""Memory of flooded messages: a sensor takes a message, and passes it on, if it is newer than the last of its key.

    heard (origin, key, stamp) --newer than the last stamp of (origin, key)--> take it, and pass it on
                               --not newer----------------------------------> drop it: a duplicate, or overtaken

A key names what a message is about: a detection by its number, a part in a task, a mode. A message is under way for
`memory_ns` at the most; a stamp that is remembered for longer excludes nothing, so a sensor that boots with its clock
set back is heard again.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from agents.bidding.bid_frames import Award, Detection, Flooded, newer_stamp

Key = tuple[object, ...]


def key_of(flooded: Flooded) -> Key:
    """Return origin and subject: a later message with the same key replaces this one."""
    message = flooded.message
    if isinstance(message, Detection):
        return flooded.origin, "D", message.target, message.number
    if isinstance(message, Award):              # says that its winner is deployed, as a mode of it does
        return message.winner, message.task
    return flooded.origin, message.task


@dataclass
class Flood:
    memory_ns: int
    _newest: dict[Key, tuple[int, int]] = field(default_factory=dict)      # stamp [us], when it was heard [ns]

    def is_new(self, flooded: Flooded, now_ns: int) -> bool:
        """Return whether the message is to be taken and passed on, and remember it; `now_ns` in local time."""
        key = key_of(flooded)
        known = self._newest.get(key)
        if known is not None and now_ns - known[1] <= self.memory_ns and not newer_stamp(flooded.stamp_us, known[0]):
            return False
        self._newest[key] = flooded.stamp_us, now_ns
        return True

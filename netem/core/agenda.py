"""The emulator's event list: a heap ordered by (time, priority, name, sequence).

SimPy orders events by (time, priority, order of scheduling), so the order in which reports arrive would decide between
simultaneous events. Here the name of the node or link decides, and the result does not depend on the host.
"""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush
from typing import Final

from netem.wire.instants import NEVER_NS

# Order at one instant: nodes show where they are, media compare it with where they were, transmissions end, timers of
# the media run, then offers are made.
SHOW: Final = -2
SHOWN: Final = -1
END_OF_FRAME: Final = 0
TIMER: Final = 1
OFFER: Final = 2


class Agenda:
    """Events of the emulator. `now_ns` is the time of the event that runs now or ran last."""

    def __init__(self) -> None:
        self.now_ns = 0
        self._heap: list[tuple[int, int, str, int, Callable[[], None]]] = []
        self._sequence = 0

    def at(self, time_ns: int, priority: int, name: str, action: Callable[[], None]) -> None:
        """Schedule `action` for `time_ns`, which must not lie before `now_ns`."""
        assert time_ns >= self.now_ns, f"event of {name} at {time_ns} ns lies before now ({self.now_ns} ns)"
        heappush(self._heap, (time_ns, priority, name, self._sequence, action))
        self._sequence += 1

    def next_ns(self) -> int:
        """Time of the next event, `NEVER_NS` if there is none."""
        return self._heap[0][0] if self._heap else NEVER_NS

    def run_before(self, until_ns: int) -> None:
        """Run every event with time < `until_ns` in order, including events that are scheduled meanwhile."""
        heap = self._heap
        while heap and heap[0][0] < until_ns:
            time_ns, _, _, _, action = heappop(heap)
            self.now_ns = time_ns
            action()

"""Computing takes time: what a call costs a thread that calls again and again and lets no time pass by itself.

In virtual time a program computes in zero time, so a loop that looks at a clock until it shows more would never end.
On a machine each look takes some time; here it does from the `FIRST_ROW`-th call in a row on:

    cost of a call = 0                                           within the first calls of the row
                   = clip(time spent in the row / 1000, 1 us, 100 us)     afterwards

The calls that count are those that tell the time, look for something that is not there, send, or sleep for less than
1 us. Time is that of the node's oscillator. A row ends when the thread waits for 1 us or more, or takes a message.

Invariants:
- a program that never makes `FIRST_ROW` such calls in a row is at the same instants as if calls cost nothing;
- the cost follows from the thread's own calls alone, so repeated runs agree;
- a thread that has spun once is taken to spin again after `LATER_ROW` calls: each of its busy waits would otherwise
  take the emulator `FIRST_ROW` calls at one instant.
"""

from __future__ import annotations

from typing import Final

FIRST_ROW: Final = 10_000           # calls
LATER_ROW: Final = 100
SHORTEST_NS: Final = 1_000          # about what a call to read a clock takes in Python
LONGEST_NS: Final = 100_000         # the resolution of a busy wait of 0.1 s or more
RESOLUTION: Final = 1_000           # a busy wait of T ends at most T / RESOLUTION late, or `SHORTEST_NS`


class CallsInARow:
    """The row of calls of one thread."""

    def __init__(self) -> None:
        self._calls = 0
        self._free = FIRST_ROW
        self._spent_ns = 0

    def end(self) -> None:
        """Time has passed by itself, or the thread got something: the next call is the first of a new row."""
        self._calls = self._spent_ns = 0

    def next_cost_ns(self) -> int:
        """Count one call; what it costs on the node's oscillator."""
        self._calls += 1
        if self._calls < self._free:
            return 0
        self._free = LATER_ROW
        cost_ns = min(LONGEST_NS, max(SHORTEST_NS, self._spent_ns // RESOLUTION))
        self._spent_ns += cost_ns
        return cost_ns

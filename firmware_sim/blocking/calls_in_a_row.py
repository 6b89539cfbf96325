"""The time that a call costs a thread which makes many calls in a row without waiting.

In virtual time a program computes in zero time, so a loop that reads a clock until it shows more would never end. On a
real machine each reading takes some time; here it does from the `FIRST_ROW`-th call in a row on:

    cost of a call = 0                                           within the first calls of the row
                   = clip(time spent in the row / 1000, 1 us, 100 us)     afterwards

Counted are calls that read a clock, poll for something that is not there, send, or sleep for less than 1 us. Time is
that of the node's oscillator. A row ends when the thread waits for 1 us or more, or receives a message.

Invariants:
- for a program that never makes `FIRST_ROW` such calls in a row, calls cost nothing;
- the cost depends on the thread's own calls only, so repeated runs agree;
- after a thread's first row of that length, later ones cost time from `LATER_ROW` calls on: otherwise each of its busy
  waits would take the emulator `FIRST_ROW` calls at one instant.
"""

from __future__ import annotations

from typing import Final

FIRST_ROW: Final = 10_000           # calls
LATER_ROW: Final = 100
SHORTEST_NS: Final = 1_000          # about the time of one reading of a clock in Python
LONGEST_NS: Final = 100_000         # resolution of a busy wait of 0.1 s or more
RESOLUTION: Final = 1_000           # a busy wait of T ends late by at most T / RESOLUTION, or by `SHORTEST_NS`


class CallsInARow:
    """The row of calls of one thread."""

    def __init__(self) -> None:
        self._calls = 0
        self._free = FIRST_ROW
        self._spent_ns = 0

    def end(self) -> None:
        """End the row: the thread has waited or received a message, so its next call is the first of a new row."""
        self._calls = self._spent_ns = 0

    def next_cost_ns(self) -> int:
        """Count one call; return its cost on the node's oscillator [ns]."""
        self._calls += 1
        if self._calls < self._free:
            return 0
        self._free = LATER_ROW
        cost_ns = min(LONGEST_NS, max(SHORTEST_NS, self._spent_ns // RESOLUTION))
        self._spent_ns += cost_ns
        return cost_ns

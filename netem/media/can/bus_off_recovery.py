"""Recovery from bus-off: a controller takes part again after 128 runs of 11 recessive bits.

    occurrences += (length of a recessive run) // 11 bits         counting starts anew after 11, and with every run

A frame ends in a run of 11 (ACK delimiter, end of frame, intermission), and so does an error frame (error delimiter,
intermission): a busy bus gives one occurrence a frame, an idle one 128 in 1408 bits. Counting can start later than
bus-off, when the node's software restarts its controller.

Source: ISO 11898-1:2015, 12.1.4.4.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from netem.media.can.bit_clock import BitClock

OCCURRENCES = 128
RUN_BITS = 11


@dataclass
class BusOffRecovery:
    clock: BitClock
    since_ns: int                   # counting starts here at the earliest
    run_ns: int                     # start of the current recessive run
    occurrences: int = field(default=0, init=False)

    def due_ns(self) -> int:
        """Instant at which the recovery is complete if the bus stays idle from now on."""
        bits = (OCCURRENCES - self.occurrences) * RUN_BITS
        return max(self.since_ns, self.run_ns) + self.clock.ns(bits * self.clock.nominal)

    def interrupted(self, start_ns: int, next_run_ns: int) -> None:
        """Count the recessive bits until a frame starts at `start_ns`; the next run begins at `next_run_ns`."""
        run_ns = start_ns - max(self.since_ns, self.run_ns)
        if run_ns > 0:
            bits = (run_ns + 1) * self.clock.ticks_per_ns // self.clock.nominal      # + 1: instants are rounded
            self.occurrences = min(self.occurrences + bits // RUN_BITS, OCCURRENCES)
        self.run_ns = next_run_ns

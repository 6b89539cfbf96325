"""Places of the components of a loop's state, with registers for values that are on their way.

A sender's registers shift when it sends, the newest first. A value with delay d arrives at a fixed instant of each
round; it is then in the register whose number is the count of the values sent since.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from agents.synchronization.graph import Floats
from agents.waves.jump_loop import Jump


class Places:
    """Gives out components of z, one after the other."""

    def __init__(self) -> None:
        self.size = 0

    def take(self, count: int) -> slice:
        taken = slice(self.size, self.size + count)
        self.size += count
        return taken

    def one(self) -> int:
        self.size += 1
        return self.size - 1


class Registers:
    """Those of the values that one sender sends every round, and one receiver uses `delay_ns` later."""

    def __init__(self, places: Places, first_ns: int, delay_ns: int, round_ns: int) -> None:
        self._at = places.take(1 - (-delay_ns // round_ns))
        self.arrival_ns = (first_ns + delay_ns) % round_ns
        self._arriving = (self.arrival_ns - first_ns) // round_ns + (first_ns + delay_ns) // round_ns
        self.used = places.one()

    @property
    def all(self) -> Iterator[int]:
        """The registers, and the place of the value in use."""
        yield from range(self._at.start, self._at.stop)
        yield self.used

    def shift(self, J: Floats, newest: Floats) -> None:
        """Let a jump shift the registers and take `newest`, a row that acts on z, into the first."""
        for n in range(self._at.stop - 1, self._at.start, -1):
            J[n] = np.eye(len(J))[n - 1]
        J[self._at.start] = newest

    def arrive(self, size: int) -> Jump:
        """Return the jump at which the value that arrives comes into use."""
        J = np.eye(size)
        J[self.used] = np.eye(size)[self._at.start + self._arriving]
        return Jump(self.arrival_ns, J)


def in_order(sends: list[Jump], arrivals: list[Jump]) -> tuple[Jump, ...]:
    """Return all jumps by time; at one instant those that send come first, so that a value without delay is used."""
    return tuple(sorted([*sends, *arrivals], key=lambda jump: jump.at_ns))

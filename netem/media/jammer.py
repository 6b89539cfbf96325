"""A jammer on a radio channel: when its bursts are on the air, and which nodes hear them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Jammer:
    """Bursts of `burst_ns` every `period_ns` from `start_ns` on, before `end_ns`.

    They are heard by the `named` nodes and those whose `position(node, t_ns)` lies where `holds(position)`.
    """

    cause: str
    start_ns: int
    end_ns: int
    period_ns: int
    burst_ns: int
    named: frozenset[str]
    holds: Callable[[Sequence[float]], bool] | None
    position: Callable[[str, int], Sequence[float] | None]

    def hears(self, node: str, t_ns: int) -> bool:
        if self.holds is None:
            return node in self.named
        at_m = self.position(node, t_ns)
        return at_m is not None and self.holds(at_m)

    def hits(self, node: str, start_ns: int, end_ns: int) -> bool:
        """Return whether a burst at `node` overlaps a frame on [start, end); one without airtime is an instant."""
        last_ns = max(start_ns, end_ns - 1)             # the last instant at which the frame is on the air
        if last_ns < self.start_ns or start_ns >= self.end_ns:
            return False
        number = max(0, start_ns - self.start_ns) // self.period_ns
        return any(begins_ns <= last_ns and start_ns < ends_ns and self.hears(node, max(start_ns, begins_ns))
                   for begins_ns, ends_ns in (self.burst(number), self.burst(number + 1)))

    def burst(self, number: int) -> tuple[int, int]:
        """Return the window of burst `number`, counted from 0; it is empty after the end."""
        begins_ns = self.start_ns + number * self.period_ns
        return min(begins_ns, self.end_ns), min(begins_ns + self.burst_ns, self.end_ns)


def cause_of(jammers: Sequence[Jammer], node: str, start_ns: int, end_ns: int) -> str:
    """Return the cause of the first jammer that hits a frame at `node`, "" if none does."""
    return next((jammer.cause for jammer in jammers if jammer.hits(node, start_ns, end_ns)), "")

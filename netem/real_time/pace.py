"""The wall clock of a run in real time: nothing happens before its instant, and who is outside is heard at theirs.

    virtual time t  <->  wall clock began + t            absolute: nothing is added up, so lateness does not grow

The emulator asks to wait for its next instant; the wait ends early when something comes in. What goes out through a
gateway waits for its arrival in virtual time. Lateness is how far behind the wall clock an instant began.

Invariants:
- what comes in has a virtual time not before the wall clock's;
- everything handed out through a gateway leaves at or after its virtual time, in order.
"""

from __future__ import annotations

import heapq
import selectors
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from netem.real_time import Gateway

OVERRUN_NS: Final = 10_000_000      # lateness beyond is an event


class FromOutside(NamedTuple):
    gateway: str
    medium: str
    data: bytes


@dataclass
class Lateness:
    instants: int = 0
    total_ns: int = 0
    worst_ns: int = 0
    overruns: int = 0               # stretches of more than OVERRUN_NS

    @property
    def mean_ns(self) -> float:
        return self.total_ns / self.instants if self.instants else 0.0


@dataclass
class Pace:
    gateways: Iterable[Gateway] = ()
    event: Callable[[int, str, str], None] = lambda time_ns, kind, detail: None
    lateness: Lateness = field(default_factory=Lateness)

    def __post_init__(self) -> None:
        self._by_name = {gateway.name: gateway for gateway in self.gateways}
        self._selector = selectors.DefaultSelector()
        for gateway in self._by_name.values():
            self._selector.register(gateway.fileno(), selectors.EVENT_READ, gateway)
        self._leaving: list[tuple[int, int, str, bytes]] = []       # a heap by time, then order
        self._taken = 0
        self._began_ns = time.monotonic_ns()
        self._behind = False

    def start(self) -> None:
        """Virtual time 0 is now."""
        self._began_ns = time.monotonic_ns()

    def now_ns(self) -> int:
        return time.monotonic_ns() - self._began_ns

    def take(self, gateway: str, arrival_ns: int, data: bytes) -> bool:
        """A frame arrives at a gateway at `arrival_ns`; False if there is no such gateway."""
        if gateway not in self._by_name:
            return False
        heapq.heappush(self._leaving, (arrival_ns, self._taken, gateway, data))
        self._taken += 1
        return True

    def wait(self, next_ns: int) -> list[FromOutside]:
        """Wait until virtual time `next_ns`, or until something comes in, which is then returned."""
        late_from_ns = self.now_ns()
        while True:
            now_ns = self._hand_out()
            until_ns = min(next_ns, self._leaving[0][0]) if self._leaving else next_ns
            ready = self._selector.select(max(0, until_ns - now_ns) * 1e-9)
            heard = [FromOutside(key.data.name, key.data.medium, data)
                     for key, _ in sorted(ready, key=lambda found: str(found[0].data.name))
                     for data in key.data.receive()]
            if heard:
                return heard
            if self.now_ns() >= next_ns:
                self._hand_out()
                self._note(next_ns, max(late_from_ns, next_ns) - next_ns)
                return []

    def close(self) -> None:
        self._selector.close()
        for gateway in self._by_name.values():
            gateway.close()

    def _hand_out(self) -> int:
        """Send what is due; the time now."""
        now_ns = self.now_ns()
        while self._leaving and self._leaving[0][0] <= now_ns:
            _, _, gateway, data = heapq.heappop(self._leaving)
            self._by_name[gateway].send(data)
        return now_ns

    def _note(self, at_ns: int, late_ns: int) -> None:
        lateness = self.lateness
        lateness.instants += 1
        lateness.total_ns += late_ns
        lateness.worst_ns = max(lateness.worst_ns, late_ns)
        behind = late_ns > OVERRUN_NS
        if behind and not self._behind:
            lateness.overruns += 1
            self.event(at_ns, "overrun", f"{late_ns * 1e-6:.3g} ms behind the wall clock")
        self._behind = behind

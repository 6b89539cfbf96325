"""The wall clock of a run in real time: no event happens before its instant.

    virtual time t  <->  wall clock at the start + t     absolute instants, so lateness does not accumulate

The emulator calls `wait` for its next instant. The wait ends at the instant, or earlier when a message arrives from
outside. A gateway receives when its descriptor can be read, and at the instant that its `due_ns` names. The wait for an
overdue instant ends at once and takes at most MOST_WHEN_OVERDUE messages from each gateway, so that neither a flood of
messages stops virtual time nor a run that is always late ignores its gateways. A frame to a gateway is sent when the
wall clock reaches its arrival. Lateness is the time from an instant to the end of the wait for it.

Invariants:
- a message from outside gets a virtual time at or after that of the wall clock;
- gateways send every frame at or after its arrival in virtual time, in order.
"""

from __future__ import annotations

import heapq
import selectors
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from netem.gateways import Gateway
from netem.gateways.lateness import OVERRUN_NS, Lateness
from netem.wire.instants import NEVER_NS
from netem.wire.level import Level

MOST_AT_ONCE: Final = 100           # messages that one wait takes from one gateway
MOST_WHEN_OVERDUE: Final = 1        # the same if the instant is overdue; others wait in the system's buffer


class FromOutside(NamedTuple):
    gateway: str
    medium: str
    data: bytes


class Waited(NamedTuple):
    """The result of a wait: whether the instant was reached, and the messages that arrived."""

    reached: bool
    heard: list[FromOutside]


@dataclass
class Pace:
    gateways: Iterable[Gateway] = ()
    event: Callable[[int, str, str, Level], None] = lambda time_ns, kind, detail, level: None
    lateness: Lateness = field(default_factory=Lateness)

    def __post_init__(self) -> None:
        self._by_name = {gateway.name: gateway for gateway in self.gateways}
        self._selector = selectors.DefaultSelector()
        for gateway in self._by_name.values():
            self._selector.register(gateway.fileno(), selectors.EVENT_READ, gateway)
        self._attended = 0                                          # files besides those of gateways
        self._leaving: list[tuple[int, int, str, bytes]] = []       # a heap by time, then order
        self._taken = 0
        self._began_ns = time.monotonic_ns()
        self._behind = False

    def attend(self, file: Any, call: Callable[[], None]) -> None:
        """Call `call` during a wait whenever `file`, a socket, can be read; the wait then ends early."""
        self._selector.register(file, selectors.EVENT_READ, call)
        self._attended += 1

    def leave(self, file: Any) -> None:
        """Attend to `file` no more."""
        self._selector.unregister(file)
        self._attended -= 1

    def start(self) -> None:
        """Make the present virtual time 0."""
        self._began_ns = time.monotonic_ns()

    def now_ns(self) -> int:
        return time.monotonic_ns() - self._began_ns

    def take(self, gateway: str, arrival_ns: int, data: bytes) -> None:
        """Keep a frame that arrives at a gateway at `arrival_ns`, to send it then."""
        heapq.heappush(self._leaving, (arrival_ns, self._taken, gateway, data))
        self._taken += 1

    def wait(self, next_ns: int) -> Waited:
        """Wait until virtual time `next_ns`, or until a message arrives from outside."""
        while True:
            now_ns = self._send_due()
            until_ns = min(next_ns, self._leaving[0][0]) if self._leaving else next_ns
            until_ns = min(until_ns, self._gateways_due_ns())
            overdue = now_ns >= next_ns
            ready = self._selector.select(max(0, until_ns - now_ns) * 1e-9)
            attended = self._attended > 0 and self._call_attended(ready)
            heard = [FromOutside(gateway.name, gateway.medium, data) for gateway in self._receiving(ready)
                     for data in gateway.receive(MOST_WHEN_OVERDUE if overdue else MOST_AT_ONCE)]
            reached = not attended and self.now_ns() >= next_ns
            if reached:
                self._note(next_ns, self._send_due() - next_ns)
            if reached or heard or attended:
                return Waited(reached, heard)

    def counters(self) -> dict[str, Mapping[str, int]]:
        """Return the counters of each gateway."""
        return {name: gateway.counters() for name, gateway in self._by_name.items()}

    def close(self) -> None:
        self._selector.close()
        for gateway in self._by_name.values():
            gateway.close()

    def _gateways_due_ns(self) -> int:
        """Return the virtual time at which the first gateway receives though its descriptor is silent."""
        return min((gateway.due_ns() for gateway in self._by_name.values()), default=NEVER_NS) - self._began_ns

    def _receiving(self, ready: list[tuple[selectors.SelectorKey, int]]) -> list[Gateway]:
        """Return the gateways whose descriptors can be read or that are due, by name."""
        readable = [key.data for key, _ in ready]
        now_ns = time.monotonic_ns()
        return [gateway for _, gateway in sorted(self._by_name.items())
                if gateway in readable or gateway.due_ns() <= now_ns]

    def _call_attended(self, ready: list[tuple[selectors.SelectorKey, int]]) -> bool:
        """Make the calls for files that can be read; return whether there were any."""
        calls = [found[0].data for found in ready if found[0].data not in self._by_name.values()]
        for call in calls:
            call()
        return bool(calls)

    def _send_due(self) -> int:
        """Send the frames that are due; return the present virtual time [ns]."""
        now_ns = self.now_ns()
        while self._leaving and self._leaving[0][0] <= now_ns:
            _, _, gateway, data = heapq.heappop(self._leaving)
            self._by_name[gateway].send(data)
        return now_ns

    def _note(self, at_ns: int, late_ns: int) -> None:
        self.lateness.add(late_ns)
        behind = late_ns > OVERRUN_NS
        if behind and not self._behind:
            self.lateness.overruns += 1
            self.event(at_ns, "overrun", f"{late_ns * 1e-6:.3g} ms behind the wall clock", Level.WARNING)
        self._behind = behind

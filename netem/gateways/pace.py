"""The wall clock of a run in real time: no event happens before its instant.

    virtual time t  <->  wall clock at the start + t / rate     absolute instants, so lateness does not accumulate

The emulator calls `wait` for its next instant. The wait ends at the instant, or earlier when a message arrives from
outside. A gateway receives when its descriptor can be read, and at the instant that its `due_ns` names. The wait for an
overdue instant ends at once and takes at most MOST_WHEN_OVERDUE messages from each gateway, so that neither a flood of
messages stops virtual time nor a run that is always late ignores its gateways. A frame to a gateway is sent when the
wall clock reaches its arrival.

Lateness is measured on the wall clock, for two kinds of events:
- an instant, from when it is due to the end of the wait for it;
- a delivery, to a gateway from its arrival to when the frame is sent outside, and to a node from its arrival to when
  the node has answered the grant with it. A node that promised to send nothing before a later instant gets its frames
  then, and they are due then; a frame that it gets ahead of its arrival is not late.

An event that is later than the limit is an overrun: the run goes on late and catches up, or `Overrun` is raised.

Invariants:
- a message from outside gets the virtual time that the wall clock had when it arrived; one that arrived before the
  start is dropped and counted;
- gateways send every frame at or after its arrival in virtual time, in order.
"""

from __future__ import annotations

import heapq
import selectors
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Final, NamedTuple

from netem.gateways import Arrival, Gateway
from netem.gateways.lateness import Lateness
from netem.gateways.real_time_settings import RealTimeSettings
from netem.gateways.time_watch import ASK_EVERY_NS, TimeWatch
from netem.gateways.timer import Timer
from netem.wire.instants import NEVER_NS
from netem.wire.level import Level

MOST_AT_ONCE: Final = 100           # messages that one wait takes from one gateway
MOST_WHEN_OVERDUE: Final = 1        # the same if the instant is overdue; others wait in the system's buffer
SPIN_NS: Final = 150_000            # the last part of a long wait, in which this thread only reads the clock
LONG_WAIT_NS: Final = 1_000_000     # shorter waits have no such part, so that reading takes 15 % of a core at most
EARLY: Final = "messages before the start"  # a counter
FINEST_RATE: Final = 1_000_000      # largest denominator of the rate as a fraction


class Overrun(RuntimeError):
    """A run in real time was later than its limit, and its settings end it then."""

    exit_code = 3

    def __init__(self, what: str, at_ns: int, late_ns: int, limit_ns: int) -> None:
        super().__init__(f"{what} at {at_ns / 1e9:.9g} s happened {late_ns / 1e6:.3g} ms behind the wall clock, more "
                         f"than real_time.overrun_limit_ms = {limit_ns / 1e6:.3g}: lower --rate, raise the limit, take "
                         "load off the machine, or let the run go on late with --overrun slip")


class FromOutside(NamedTuple):
    gateway: str
    medium: str
    data: bytes
    at_ns: int                  # virtual time of its arrival, which may be before the present


class Waited(NamedTuple):
    """The result of a wait: whether the instant was reached, and the messages that arrived."""

    reached: bool
    heard: list[FromOutside]


@dataclass
class Pace:
    gateways: Iterable[Gateway] = ()
    event: Callable[[int, str, str, Level], None] = lambda time_ns, kind, detail, level: None
    settings: RealTimeSettings = field(default_factory=RealTimeSettings)
    watches: Mapping[str, TimeWatch] = field(default_factory=dict)          # by gateway
    lateness: Lateness = field(default_factory=Lateness, init=False)        # of instants
    deliveries: Lateness = field(default_factory=Lateness, init=False)
    overruns: int = field(default=0, init=False)        # sequences of events that are later than the limit

    def __post_init__(self) -> None:
        self._by_name = {gateway.name: gateway for gateway in self.gateways}
        rate = Fraction(self.settings.rate).limit_denominator(FINEST_RATE)
        self._virtual, self._wall = rate.numerator, rate.denominator        # ns that pass in the same time
        self._timer = Timer()
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._timer, selectors.EVENT_READ, None)
        for name, gateway in self._by_name.items():
            self._selector.register(gateway.fileno(), selectors.EVENT_READ, name)
        self._leaving: list[tuple[int, int, str, bytes | None]] = []    # a heap by time, then order; None: to ask
        self._taken = 0
        self._awaited_ns = -1               # end of the present long wait, by the monotonic clock
        self._began_ns = time.monotonic_ns()
        self._behind = False
        self._early: Counter[str] = Counter()       # messages that arrived before the start, by gateway

    def attend(self, file: Any, call: Callable[[], None]) -> None:
        """Call `call` during a wait whenever `file`, a socket, can be read; the wait then ends early."""
        self._selector.register(file, selectors.EVENT_READ, call)

    def leave(self, file: Any) -> None:
        """Attend to `file` no more."""
        self._selector.unregister(file)

    def start(self) -> None:
        """Make the present virtual time 0."""
        self._began_ns = time.monotonic_ns()
        for name in sorted(name for name, watch in self.watches.items() if watch.asks):
            self._leave_at(ASK_EVERY_NS, name, None)

    def now_ns(self) -> int:
        """Return the virtual time that the wall clock has reached, rounded down."""
        return self._virtual_ns(time.monotonic_ns())

    def due_ns(self, virtual_ns: int) -> int:
        """Return the instant of `time.monotonic_ns` at which the wall clock reaches `virtual_ns`."""
        return self._began_ns - (-virtual_ns * self._wall // self._virtual)

    def take(self, gateway: str, arrival_ns: int, data: bytes) -> None:
        """Keep a frame that arrives at a gateway at `arrival_ns`, to send it then."""
        self._leave_at(arrival_ns, gateway, data)

    def delivered(self, due_ns: int) -> None:
        """Note that a node has just answered the grant with a frame that is due at `due_ns`."""
        self.deliveries.add(max(0, time.monotonic_ns() - self.due_ns(due_ns)))

    def wait(self, next_ns: int) -> Waited:
        """Wait until virtual time `next_ns`, or until a message arrives from outside; raises `Overrun`."""
        while True:
            now_ns = self._send_due()
            overdue = now_ns >= next_ns
            due_ns = min(self.due_ns(min(next_ns, self._leaving[0][0]) if self._leaving else next_ns),
                         *(gateway.due_ns() for gateway in self._by_name.values()), NEVER_NS)
            wakes_ns, wall_ns = due_ns, time.monotonic_ns()
            if due_ns == self._awaited_ns or due_ns - wall_ns >= LONG_WAIT_NS:
                self._awaited_ns, wakes_ns = due_ns, due_ns - SPIN_NS
                if wakes_ns <= wall_ns < due_ns:
                    while time.monotonic_ns() < due_ns:
                        pass
                    continue
            at_once = overdue or wall_ns >= wakes_ns
            if not at_once:
                self._timer.set(wakes_ns)
            ready = self._selector.select(0 if at_once else None)
            heard, called = self._attend_to(ready, MOST_WHEN_OVERDUE if overdue else MOST_AT_ONCE)
            reached = not called and self.now_ns() >= next_ns
            if reached:
                self._send_due()
                late_ns = time.monotonic_ns() - self.due_ns(next_ns)
                self.lateness.add(late_ns)
                self._note("the instant", next_ns, late_ns)
            if reached or heard or called:
                return Waited(reached, heard)

    def counters(self) -> dict[str, Mapping[str, int]]:
        """Return the counters of each gateway."""
        return {name: {**gateway.counters(), EARLY: self._early[name]} if name in self._early else gateway.counters()
                for name, gateway in self._by_name.items()}

    def alone(self) -> list[str]:
        """Return a sentence for each gateway with which no program outside the run has spoken."""
        return [f"gateways.{name}: {why}" for name, gateway in self._by_name.items() if (why := gateway.alone())]

    def figures(self) -> dict[str, Any]:
        """Return the entries of `run.json`: the lateness of instants and of deliveries, rate, limit and overruns."""
        return {**self.totals(), **self.lateness.figures(),
                "overrun_limit_ns": self.settings.overrun_limit_ns, "rate": self.settings.rate,
                "deliveries": {"events": self.deliveries.events, **self.deliveries.figures()}}

    def totals(self) -> dict[str, int]:
        """Return the lateness of instants so far without its histogram, and the overruns."""
        return {"instants": self.lateness.events, **self.lateness.quantiles(), "overruns": self.overruns}

    def close(self) -> None:
        self._selector.close()
        self._timer.close()
        for gateway in self._by_name.values():
            gateway.close()

    def _attend_to(self, ready: list[tuple[selectors.SelectorKey, int]], most: int) -> tuple[list[FromOutside], bool]:
        """Make the calls for files that can be read; return gateways' messages, and whether there was a call."""
        found = [key.data for key, _ in ready]
        calls = [data for data in found if callable(data)]
        for call in calls:
            call()
        now_ns = time.monotonic_ns()
        speaking = [gateway for name, gateway in sorted(self._by_name.items())
                    if name in found or gateway.due_ns() <= now_ns]
        heard = [FromOutside(gateway.name, gateway.medium, arrival.data, self._virtual_ns(arrival.at_ns))
                 for gateway in speaking for arrival in gateway.arrivals(most) if self._enters(gateway.name, arrival)]
        return heard, bool(calls)

    def _enters(self, gateway: str, arrival: Arrival) -> bool:
        """Let the watch of the gateway see a message; return whether it goes on to the medium."""
        if arrival.at_ns < self._began_ns:
            self._early[gateway] += 1
            return False
        watch = self.watches.get(gateway)
        return watch is None or watch.enters(arrival.data, self._virtual_ns(arrival.at_ns),
                                             arrival.at_ns - self._began_ns)

    def _virtual_ns(self, wall_ns: int) -> int:
        """Return the virtual time at the instant `wall_ns` of `time.monotonic_ns`, rounded down."""
        return (wall_ns - self._began_ns) * self._virtual // self._wall

    def _clock_ns(self) -> int:
        """Return the time of the wall clock since the start of the run."""
        return time.monotonic_ns() - self._began_ns

    def _leave_at(self, time_ns: int, gateway: str, data: bytes | None) -> None:
        heapq.heappush(self._leaving, (time_ns, self._taken, gateway, data))
        self._taken += 1

    def _send_due(self) -> int:
        """Send the frames that are due; return the present virtual time [ns]."""
        now_ns = self.now_ns()
        while self._leaving and self._leaving[0][0] <= now_ns:
            arrival_ns, _, gateway, data = heapq.heappop(self._leaving)
            watch = self.watches.get(gateway)
            if data is None:
                assert watch is not None
                self._by_name[gateway].send(watch.ask(self.now_ns(), self._clock_ns()))
                self._leave_at(max(arrival_ns, now_ns) + ASK_EVERY_NS, gateway, None)
                continue
            if watch is not None:
                watch.leaves(data, arrival_ns, self.now_ns(), self._clock_ns())
            self._by_name[gateway].send(data)
            late_ns = time.monotonic_ns() - self.due_ns(arrival_ns)
            self.deliveries.add(late_ns)
            self._note(f"a frame to {gateway}", arrival_ns, late_ns)
        return now_ns

    def _note(self, what: str, at_ns: int, late_ns: int) -> None:
        """Take the end of a wait, or the sending of a frame, as an overrun if it is later than the limit."""
        limit_ns = self.settings.overrun_limit_ns
        behind = late_ns > limit_ns
        if behind and not self._behind:
            self.overruns += 1
            self.event(at_ns, "overrun", f"{late_ns * 1e-6:.3g} ms behind the wall clock", Level.WARNING)
        self._behind = behind
        if behind and self.settings.overrun == "abort":
            raise Overrun(what, at_ns, late_ns, limit_ns)

"""A node: a SimPy environment in integer nanoseconds with ports, that runs as far as it is granted.

    program --port.send--> offers of the report          deliveries of the grant --> port.on_receive / port.receive()

Invariants:
- an event of the node runs only below the granted horizon, a frame is handed out only at the time of an event;
- at one instant frames are received before the node's own timers run;
- a sample for instant s is taken when every event of the node at or before s has run.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator, Sequence
from typing import Any, Final

import simpy
from mypy_extensions import mypyc_attr
from simpy.events import Event

from netem.node.environment import NodeEnvironment, run_before
from netem.node.named import Named
from netem.wire.errors import WHOLE_NANOSECONDS
from netem.wire.instants import NEVER_NS
from netem.wire.messages import Grant, Hello, Offer, Report, Sample

FrameBytes = bytes | bytearray | memoryview | Any       # Any: what else comes is refused by name, compiled or not
WAS_ANSWERS: Final = ("a port has no `answers` any more: write `board.port(name, on_receive, listen_only=True)` for "
                      "what was `answers = False`")


def _no_plan() -> int:
    """`Node.next_frame_ns` where nobody plans for the node: its next event may hand out a frame."""
    return 0


class PromiseBroken(Exception):
    """A program hands out a frame before the instant until which it had promised silence."""


class Port:
    """Where a node hands bytes out and gets bytes in. Set `on_receive`, or wait with `yield port.receive()`.

    `listen_only`, set before the start, promises that what arrives here makes the program hand out nothing earlier
    than planned: a frame then waits for the node's next grant, still acting at its own time, and costs none.
    """

    def __init__(self, node: Node, index: int, name: str) -> None:
        self.node = node
        self.index = index
        self.name = name
        self.on_receive: Callable[[bytes], None] | None = None
        self.listen_only = False
        self._waiting: simpy.Store = simpy.Store(node.env)

    @property
    def answers(self) -> bool:
        """The name that `listen_only` had, the other way round."""
        raise AttributeError(WAS_ANSWERS)

    @answers.setter
    def answers(self, value: bool) -> None:
        raise AttributeError(WAS_ANSWERS)

    def send(self, data: FrameBytes) -> None:
        """Hand `data` out now: bytes, or a bytearray or memoryview as it is now."""
        self.node.hand_out(self.index, data)

    def receive(self) -> Event:
        """SimPy event whose value is the next frame that was not taken yet."""
        return self._waiting.get()

    def keep(self, data: bytes) -> None:
        """Nobody listens: `data` waits for `receive`."""
        self._waiting.put(data)


@mypyc_attr(allow_interpreted_subclasses=True)
class Node:
    def __init__(self, name: str, ports: Sequence[str], sample_period_ns: int = 0) -> None:
        if sample_period_ns < 0:
            raise ValueError(f"sample_period_ns={sample_period_ns}: expected 0 (no samples) or more")
        self.name = name
        self.env = NodeEnvironment()
        self.ports: Named[Port] = Named({port: Port(self, index, port) for index, port in enumerate(ports)}, name,
                                        "port", f"no medium is attached: agents.{name}.media or [media] names none")
        self._port_list = list(self.ports.values())
        self._firm_ns = 0
        self._unless_heard_ns = 0
        self._hears = True              # some port is not `listen_only`
        self._offers: list[Offer] = []
        self._samples: list[Sample] = []
        self._events: list[tuple[int, str, str]] = []
        self._counters: Counter[str] = Counter()
        self._signals: list[tuple[str, str]] = []
        self._reads: list[tuple[tuple[str, ...], Callable[[], Sequence[Any]]]] = []
        self._sample_period_ns = sample_period_ns
        self._next_sample_ns = 0 if sample_period_ns else NEVER_NS
        self._shows: list[tuple[int, int, Callable[[int], bytes]]] = []     # (port, period_ns, read)
        self._next_show_ns = NEVER_NS
        self._reading_ns = -1           # the instant of the sample or show that is being read, -1 for none
        self.next_frame_ns: Callable[[], int] = _no_plan      # before when the program has planned no frame
        self._ends_ns = NEVER_NS        # when this node ends the run,
        self._ends_because = ""         # and why

    # --- what a program uses

    @property
    def now_ns(self) -> int:
        return self.env.time_ns()

    def present_ns(self) -> int:
        """True time that the program stands at: of its event, or of the sample or show that is being read."""
        now_ns: int = self._reading_ns if self._reading_ns >= 0 else self.env.now_ns      # no call: plants ask often
        return now_ns

    @property
    def signal_names(self) -> frozenset[str]:
        """The signals that are declared so far."""
        return frozenset(name for name, _ in self._signals)

    def end_run(self, because: str, time_ns: int) -> None:
        """End the whole run at `time_ns`, for a reason that is no failure; the first reason given stands.

        Exceptions of the program from now on are taken for a consequence of the end.
        """
        if self._ends_ns == NEVER_NS:
            self._ends_ns, self._ends_because = time_ns, because

    def start(self, program: Generator[Event, Any, Any]) -> simpy.Process:
        """Run `program` as a process of this node from now on."""
        return self.env.process(program)

    def call_in(self, delay_ns: int, action: Callable[[Event], None]) -> None:
        """Call `action` after `delay_ns`."""
        if delay_ns < 0:
            raise ValueError(f"{self.name}: delay_ns={delay_ns}: expected 0 or more")
        self.env.call_in(delay_ns, action)

    def promise_firm(self, time_ns: int) -> None:
        """Firm promise: hand out nothing before `time_ns`, whatever is heard. A promise given is never taken back."""
        if time_ns > self._firm_ns:
            self._firm_ns = time_ns

    def promise_soft(self, time_ns: int) -> None:
        """Promise for a program whose own events before `time_ns` hand out nothing: until it hears something.

        A frame at a port that is not `listen_only` ends the promise. Until then a promise given is not taken back.
        """
        if time_ns > self._unless_heard_ns:
            self._unless_heard_ns = time_ns

    def hand_out(self, port: int, data: FrameBytes) -> None:
        now_ns: Any = self.env.now_ns
        if type(now_ns) is not int:
            raise TypeError(f"{self._port_list[port].name}: a frame at {now_ns!r} ns: {WHOLE_NANOSECONDS}")
        if type(data) is not bytes:
            if not isinstance(data, bytearray | memoryview):
                raise TypeError(f"{self._port_list[port].name}: {data!r} is {type(data).__name__}: a frame is bytes")
            data = bytes(data)
        if now_ns < self._firm_ns or now_ns < self._unless_heard_ns:
            raise PromiseBroken(f"{self._port_list[port].name}: a frame at {now_ns} ns, but silence was promised until "
                                f"{max(self._firm_ns, self._unless_heard_ns)} ns")
        self._offers.append((now_ns, port, data))

    def signals(self, names_and_units: Sequence[tuple[str, str]], read: Callable[[], Sequence[Any]]) -> None:
        """Sample these signals: `read()` gives one value for each at `present_ns`, at every sample instant."""
        known = {name for name, _ in self._signals}
        twice = [name for name, _ in names_and_units if name in known]
        if twice:
            raise ValueError(f"{self.name}: signal {twice[0]!r} is there already: each name once")
        self._signals.extend(names_and_units)
        self._reads.append((tuple(name for name, _ in names_and_units), read))

    def show(self, port: str, period_ns: int, read: Callable[[int], bytes]) -> None:
        """Hand `read(time_ns)` out at 0, period, 2 period, ... of true time, whatever the program promises: light does
        not ask it. A program in one of these instants has not acted yet."""
        if period_ns < 1:
            raise ValueError(f"period_ns={period_ns}: expected at least 1")
        self._shows.append((self.ports[port].index, period_ns, read))
        self._next_show_ns = 0

    def count(self, name: str, by: int = 1) -> None:
        self._counters[name] += by

    def event(self, kind: str, detail: str = "") -> None:
        """Something worth a line in the record of the run, with the time of now."""
        try:
            f"{kind}{detail}".encode()
        except UnicodeEncodeError:
            raise ValueError(f"event {kind!r}: {detail!r}: expected text that UTF-8 can carry; decode bytes with "
                             "errors=\"replace\"") from None
        self._events.append((self.now_ns, kind, detail))

    # --- what the host uses

    def hello(self) -> Hello:
        quiet = [port.index for port in self._port_list if port.listen_only]
        self._hears = len(quiet) < len(self._port_list)
        return Hello(self.name, min(max(self.env.next_ns(), self._unless_heard_ns), self._next_show_ns),
                     min(self._firm_ns, self._next_show_ns), list(self.ports), self._signals, quiet)

    def counters(self) -> dict[str, int]:
        """Counters of the program so far."""
        return dict(self._counters)

    def advance(self, grant: Grant) -> Report:
        """Run every event that the grant allows, and say what came of it."""
        if self._ends_ns != NEVER_NS:           # no None: mypyc assumes that it stays None
            return self._end_report(grant)
        try:
            report = self._advance(grant)
        except Exception:
            if self._ends_ns == NEVER_NS:
                raise
            return self._end_report(grant)
        return report if self._ends_ns == NEVER_NS else self._end_report(grant, report)

    def _end_report(self, grant: Grant, report: Report | None = None) -> Report:
        """Report of a node that ends the run: all that it has done so far, and no promise that would delay the end."""
        if report is None:
            report = Report(grant.window, NEVER_NS, NEVER_NS, self._offers, self._samples, self._events,
                            dict(self._counters) if grant.last else {}, "")
            self._offers, self._samples, self._events = [], [], []
        report.ends = self._ends_ns, self._ends_because
        return report

    def _advance(self, grant: Grant) -> Report:
        horizon_ns = grant.horizon_ns
        env, ports = self.env, self._port_list
        queue = env.queue
        for arrival_ns, port, data in grant.deliveries:
            if queue and queue[0][0] < arrival_ns:
                self._run_before(arrival_ns)
            if self._next_sample_ns < arrival_ns:
                self._sample_before(arrival_ns)
            if self._next_show_ns <= arrival_ns:
                self._show_before(arrival_ns + 1)
            assert env.now_ns <= arrival_ns, f"{arrival_ns} ns lies before {env.now_ns} ns"
            env.now_ns = arrival_ns
            to = ports[port]
            if not to.listen_only:
                self._unless_heard_ns = 0
            if to.on_receive is not None:
                to.on_receive(data)
            else:
                to.keep(data)
        limit_ns = horizon_ns + 1 if grant.instant else horizon_ns
        if queue and queue[0][0] < limit_ns:
            self._run_before(limit_ns)
        if self._next_sample_ns < horizon_ns:
            self._sample_before(horizon_ns)
        if (planned_ns := self.next_frame_ns()):
            if self._hears:
                self.promise_soft(planned_ns)
            else:
                self.promise_firm(planned_ns)
        firm_ns = self._firm_ns
        if self._next_show_ns != NEVER_NS:
            self._show_before(limit_ns)
            firm_ns = min(firm_ns, self._next_show_ns)
        soft_ns: Any = queue[0][0] if queue else NEVER_NS
        if type(soft_ns) is not int:
            raise TypeError(f"{self.name}: its next event is at {soft_ns!r} ns: {WHOLE_NANOSECONDS}")
        if soft_ns < self._unless_heard_ns:
            soft_ns = self._unless_heard_ns
        if soft_ns > self._next_show_ns:
            soft_ns = self._next_show_ns
        report = Report(grant.window, soft_ns, firm_ns, self._offers, self._samples, self._events,
                        dict(self._counters) if grant.last else {}, "")
        self._offers, self._samples, self._events = [], [], []
        return report

    def _run_before(self, limit_ns: int) -> None:
        """Run the node's own events before `limit_ns`, and take the samples that lie before the last of them."""
        env = self.env
        queue = env.queue
        while queue and (time_ns := queue[0][0]) < limit_ns:
            if self._next_sample_ns < time_ns:
                self._sample_before(time_ns)
            if self._next_show_ns <= time_ns:
                self._show_before(time_ns + 1)
            stop_ns = limit_ns
            if self._next_sample_ns < stop_ns:
                stop_ns = self._next_sample_ns + 1
            if self._next_show_ns < stop_ns:
                stop_ns = self._next_show_ns
            run_before(stop_ns, env)

    def _sample_before(self, time_ns: int) -> None:
        while self._next_sample_ns < time_ns:
            values: list[float] = []
            self._reading_ns = self._next_sample_ns
            for names, read in self._reads:
                given = read()
                found: list[float] = []
                try:
                    for value in given:
                        found.append(value if type(value) is float else float(value))
                except (TypeError, ValueError) as error:
                    raise ValueError(f"{self.name}: the signals {', '.join(names)} at {self._next_sample_ns} ns: "
                                     f"{given!r}: expected numbers: {error}") from None
                if len(found) != len(names):
                    raise ValueError(f"{self.name}: {len(found)} values for the signals {', '.join(names)} at "
                                     f"{self._next_sample_ns} ns: expected {len(names)}")
                values += found
            if values:
                self._samples.append((self._next_sample_ns, values))
            self._next_sample_ns += self._sample_period_ns
        self._reading_ns = -1

    def _show_before(self, time_ns: int) -> None:
        while (now_ns := self._next_show_ns) < time_ns:
            self._reading_ns = now_ns
            for port, period_ns, read in self._shows:
                if now_ns % period_ns == 0:
                    self._offers.append((now_ns, port, read(now_ns)))
            self._next_show_ns = min(now_ns - now_ns % period_ns + period_ns for _, period_ns, _ in self._shows)
        self._reading_ns = -1

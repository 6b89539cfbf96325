"""A node: a SimPy environment in integer nanoseconds, with ports, that runs up to the horizon of each grant.

    program --port.send--> offers of the report          deliveries of the grant --> port.on_receive / port.receive()

Invariants:
- an event of the node runs only before the granted horizon; an offer has the time of the event that makes it;
- at one instant deliveries precede the node's own events;
- a sample for instant s is taken after every event of the node at or before s.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator, Mapping, Sequence
from math import nan
from typing import Any, Final

import simpy
from mypy_extensions import mypyc_attr
from simpy.events import Event

from netem.node.environment import NodeEnvironment, call_in, run_before
from netem.node.named import Named
from netem.wire.errors import WHOLE_NANOSECONDS
from netem.wire.instants import NEVER_NS
from netem.wire.level import Level
from netem.wire.messages import Event as ToldEvent
from netem.wire.messages import Grant, Hello, Life, NodeFault, Offer, Report, Sample, Shown

FrameBytes = bytes | bytearray | memoryview | Any       # Any: `Node.offer` refuses other types, compiled or not
WAS_ANSWERS: Final = ("a port has no `answers` any more: write `board.port(name, on_receive, listen_only=True)` for "
                      "what was `answers = False`")


def _no_plan() -> int:
    """Default of `Node.next_frame_ns`: the program gives no promise, so its next event may send a frame."""
    return 0


class PromiseBroken(Exception):
    """A program sent a frame before the instant until which it had promised to send none."""


class Port:
    """Sends and receives a node's frames on one medium. Set `on_receive`, or wait with `yield port.receive()`.

    `listen_only`, set before the start, promises that no frame arriving here makes the program send earlier than
    planned. Such a frame costs no grant: the emulator delivers it with the next one, and it acts at its own time.
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
        """Refuse the former name of `listen_only`, which had the opposite value."""
        raise AttributeError(WAS_ANSWERS)

    @answers.setter
    def answers(self, value: bool) -> None:
        raise AttributeError(WAS_ANSWERS)

    def send(self, data: FrameBytes) -> None:
        """Send `data` now: bytes, or a copy of a bytearray or memoryview. TypeError for anything else."""
        self.node.offer(self.index, data)

    def receive(self) -> Event:
        """Return a SimPy event whose value is the next delivered frame that has not been received yet."""
        return self._waiting.get()

    def keep(self, data: bytes) -> None:
        """Keep a delivered frame for `receive`; called if no `on_receive` is set."""
        self._waiting.put(data)


@mypyc_attr(allow_interpreted_subclasses=True)
class Node:
    def __init__(self, name: str, ports: Sequence[str], sample_period_ns: int = 0, life: Life | None = None) -> None:
        """`life` is that of a node that was killed: this one takes its place, from its instant on."""
        if sample_period_ns < 0:
            raise ValueError(f"sample_period_ns={sample_period_ns}: expected 0 (no samples) or more")
        self.name = name
        self.from_ns = 0 if life is None else life.from_ns
        self.env = NodeEnvironment(self.from_ns)
        self.ports: Named[Port] = Named({port: Port(self, index, port) for index, port in enumerate(ports)}, name,
                                        "port", f"no medium is attached: agents.{name}.media or [media] names none")
        self._port_list = list(self.ports.values())
        self._firm_ns = 0
        self._soft_ns = 0
        self._listens = True            # False if every port is `listen_only`
        self._offers: list[Offer] = []
        self._samples: list[Sample] = []
        self._events: list[ToldEvent] = []
        self._counters: Counter[str] = Counter()
        self._before_counters: list[Callable[[], object]] = []
        self._signals: list[tuple[str, str]] = []
        self._reads: list[tuple[tuple[str, ...], Callable[[], Sequence[Any]]]] = []
        self._sample_period_ns = sample_period_ns
        self._next_sample_ns = _multiple_from(self.from_ns, sample_period_ns) if sample_period_ns else NEVER_NS
        self._shows: list[tuple[int, int, Callable[[], Sequence[float]]]] = []      # (port, period_ns, read)
        self._shown: list[Shown] = []
        self._next_show_ns = NEVER_NS
        self._reading_ns = -1           # instant of the sample or show that is being read, -1 for none
        self.next_frame_ns: Callable[[], int] = _no_plan      # returns the earliest instant of a planned frame
        self._ends_ns = NEVER_NS        # instant at which this node ends the run
        self._ends_because = ""         # reason of that end
        self._fault_acts: dict[str, Callable[[Mapping[str, Any]], bytes | None]] = {"pause": self._pause}
        self._at_end: list[Callable[[], object]] = []
        self._former: list[tuple[str, str]] = []    # signals of the first life of a node that was killed
        if life is not None:
            self._former = list(life.signals)
            for index in life.quiet:
                self._port_list[index].listen_only = True

    # --- for programs

    @property
    def now_ns(self) -> int:
        return self.env.time_ns()

    def present_ns(self) -> int:
        """Return the true time of the event that runs, or of the sample or show that is being read."""
        now_ns: int = self._reading_ns if self._reading_ns >= 0 else self.env.now_ns      # no call: plants ask often
        return now_ns

    @property
    def signal_names(self) -> frozenset[str]:
        """The names of the signals declared so far."""
        return frozenset(name for name, _ in self._signals)

    def end_run(self, because: str, time_ns: int) -> None:
        """End the whole run at `time_ns` for a reason that is no failure; only the first call has an effect.

        Exceptions of the program from now on are ignored as consequences of the end.
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
        call_in(self.env, delay_ns, action)

    def promise_firm(self, time_ns: int) -> None:
        """Promise to send nothing before `time_ns`, whatever arrives. A promise cannot be withdrawn."""
        if time_ns > self._firm_ns:
            self._firm_ns = time_ns

    def promise_soft(self, time_ns: int) -> None:
        """Promise to send nothing before `time_ns` unless a frame arrives at a port that is not `listen_only`.

        Such a frame ends the promise; until then it cannot be withdrawn.
        """
        if time_ns > self._soft_ns:
            self._soft_ns = time_ns

    def offer(self, port: int, data: FrameBytes) -> None:
        """Offer `data` at port number `port` now; raises TypeError for other types of data or time, PromiseBroken."""
        now_ns: Any = self.env.now_ns
        if type(now_ns) is not int:
            raise TypeError(f"{self._port_list[port].name}: a frame at {now_ns!r} ns: {WHOLE_NANOSECONDS}")
        if type(data) is not bytes:
            if not isinstance(data, bytearray | memoryview):
                raise TypeError(f"{self._port_list[port].name}: {data!r} is {type(data).__name__}: a frame is bytes")
            data = bytes(data)
        if now_ns < self._firm_ns or now_ns < self._soft_ns:
            raise PromiseBroken(f"{self._port_list[port].name}: a frame at {now_ns} ns, but silence was promised until "
                                f"{max(self._firm_ns, self._soft_ns)} ns")
        self._offers.append((now_ns, port, data))

    def signals(self, names_and_units: Sequence[tuple[str, str]], read: Callable[[], Sequence[Any]]) -> None:
        """Sample these signals at every sample instant: `read()` returns one value for each, at `present_ns`.

        Raises ValueError if a signal is declared already.
        """
        known = {name for name, _ in self._signals}
        twice = [name for name, _ in names_and_units if name in known]
        if twice:
            raise ValueError(f"{self.name}: signal {twice[0]!r} is there already: each name once")
        if self._former:
            self._same_as_in_the_first_life(names_and_units)
        self._signals.extend(names_and_units)
        self._reads.append((tuple(name for name, _ in names_and_units), read))

    def show(self, port: str, period_ns: int, read: Callable[[], Sequence[float]]) -> None:
        """Show the medium of `port` the numbers `read()` at 0, period, 2 period, ... of true time.

        The medium gets them at that instant, without the program, as a camera sees a robot. The node's promises end at
        the next of these instants, so that no medium decides what happens later without them. At one instant they
        precede the program's events. Raises ValueError for a period below 1.
        """
        if period_ns < 1:
            raise ValueError(f"period_ns={period_ns}: expected at least 1")
        self._shows.append((self.ports[port].index, period_ns, read))
        self._next_show_ns = min(self._next_show_ns, _multiple_from(self.from_ns, period_ns))

    def count(self, name: str, by: int = 1) -> None:
        self._counters[name] += by

    def before_counters(self, action: Callable[[], object]) -> None:
        """Call `action` whenever the counters are about to be read, to bring them to `present_ns`."""
        self._before_counters.append(action)

    def event(self, kind: str, detail: str = "", level: Level = Level.INFO) -> None:
        """Record an event at the present time; raises ValueError for text that UTF-8 cannot encode."""
        try:
            f"{kind}{detail}".encode()
        except UnicodeEncodeError:
            raise ValueError(f"event {kind!r}: {detail!r}: expected text that UTF-8 can carry; decode bytes with "
                             "errors=\"replace\"") from None
        self._events.append((self.now_ns, kind, detail, level))

    def warn(self, kind: str, detail: str = "") -> None:
        """Record an event as a warning: an assumption of the program, or a requirement, does not hold."""
        self.event(kind, detail, Level.WARNING)

    def forget_signals(self) -> None:
        """Forget the signals declared so far, as the program of a node that was killed declares them anew."""
        self._signals.clear()
        self._reads.clear()

    def at_fault(self, kind: str, act: Callable[[Mapping[str, Any]], bytes | None]) -> None:
        """Let `act(fields)` carry out faults of this kind at this node.

        It returns the state that outlives the node, None if the node lives on. A fault of a kind without such a
        function ends the run with an error.
        """
        self._fault_acts[kind] = act

    def at_end(self, action: Callable[[], object]) -> None:
        """Call `action` when this node ends or is killed, to close what only its program knows of."""
        self._at_end.append(action)

    # --- for the host

    def close(self) -> None:
        """Make the calls asked for by `at_end`, the last first."""
        while self._at_end:
            self._at_end.pop()()

    def hello(self) -> Hello:
        quiet = [port.index for port in self._port_list if port.listen_only]
        self._listens = len(quiet) < len(self._port_list)
        return Hello(self.name, min(max(self.env.next_ns(), self._soft_ns), self._next_show_ns),
                     min(self._firm_ns, self._next_show_ns), list(self.ports), self._former or self._signals, quiet)

    def counters(self) -> dict[str, int]:
        """Return the counters of the program so far."""
        for action in self._before_counters:
            action()
        return dict(self._counters)

    def _counters_at(self, time_ns: int) -> dict[str, int]:
        """Return the counters at the end of the run, `time_ns`."""
        self._reading_ns = time_ns
        found = self.counters()
        self._reading_ns = -1
        return found

    def advance(self, grant: Grant) -> Report:
        """Run every event that the grant allows; return the report for the conductor."""
        if self._ends_ns != NEVER_NS:           # no None: mypyc assumes that it stays None
            return self._end_report(grant)
        try:
            report = self._advance_through_faults(grant) if grant.faults else self._advance(grant)
        except Exception:
            if self._ends_ns == NEVER_NS:
                raise
            return self._end_report(grant)
        return report if self._ends_ns == NEVER_NS else self._end_report(grant, report)

    def _end_report(self, grant: Grant, report: Report | None = None) -> Report:
        """Return the report of a node that ends the run: its work so far, and promises that do not delay the end."""
        if report is None:
            report = Report(grant.window, NEVER_NS, NEVER_NS, self._offers, self._samples, self._events,
                            self.counters() if grant.last else {}, "", None, None, self._shown)
            self._offers, self._samples, self._events, self._shown = [], [], [], []
        report.ends = self._ends_ns, self._ends_because
        return report

    def _advance_through_faults(self, grant: Grant) -> Report:
        """Advance to each fault, let it act, and go on; return all in one report."""
        offers: list[Offer] = []
        samples: list[Sample] = []
        events: list[ToldEvent] = []
        shown: list[Shown] = []
        deliveries, state = grant.deliveries, None
        for fault in grant.faults:
            earlier = [delivery for delivery in deliveries if delivery[0] < fault.time_ns]
            deliveries = deliveries[len(earlier):]
            report = self._advance(Grant(grant.window, fault.time_ns, False, False, earlier))
            offers += report.offers
            samples += report.samples
            events += report.events
            shown += report.shown
            self.env.move_to(fault.time_ns)
            self._soft_ns = self._firm_ns = 0       # the program may change its plans
            state = self._act(fault) or state
        report = self._advance(Grant(grant.window, grant.horizon_ns, grant.instant, grant.last, deliveries))
        return Report(report.window, report.soft_ns, report.firm_ns, offers + report.offers, samples + report.samples,
                      events + report.events, report.counters or self.counters(), "", None, state,
                      shown + report.shown)

    def _act(self, fault: NodeFault) -> bytes | None:
        if fault.kind not in self._fault_acts:
            raise RuntimeError(f"{self.name}: no fault {fault.kind!r} can act in this node; those that can are "
                               f"{', '.join(self._fault_acts)}")
        return self._fault_acts[fault.kind](fault.fields)

    def _pause(self, fields: Mapping[str, Any]) -> None:
        """Let no event of the program run before `until_ns`, when those that were due run in their order."""
        self.env.hold_until(fields["until_ns"])

    def _same_as_in_the_first_life(self, names_and_units: Sequence[tuple[str, str]]) -> None:
        for signal in names_and_units:
            if tuple(signal) not in [tuple(former) for former in self._former]:
                raise ValueError(f"{self.name}: signal {signal[0]!r} [{signal[1]}] was not declared before the node "
                                 "was killed: a program declares the same signals in each of its lives")

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
                self._soft_ns = 0
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
            if self._listens:
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
        if soft_ns < self._soft_ns:
            soft_ns = self._soft_ns
        if soft_ns > self._next_show_ns:
            soft_ns = self._next_show_ns
        report = Report(grant.window, soft_ns, firm_ns, self._offers, self._samples, self._events,
                        self._counters_at(horizon_ns) if grant.last else {}, "", None, None, self._shown)
        self._offers, self._samples, self._events, self._shown = [], [], [], []
        return report

    def _run_before(self, limit_ns: int) -> None:
        """Run the node's own events before `limit_ns`, with the samples and shows that are due between them."""
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
        """Take the samples before `time_ns`, with the shows that are due between them: a plant is read in order."""
        while self._next_sample_ns < time_ns:
            if self._next_show_ns <= self._next_sample_ns:
                self._show_before(self._next_sample_ns + 1)
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
            if self._former:
                values = self._by_former_signals(values)
            if values:
                self._samples.append((self._next_sample_ns, values))
            self._next_sample_ns += self._sample_period_ns
        self._reading_ns = -1

    def _by_former_signals(self, values: Sequence[float]) -> list[float]:
        """Return a value for each signal of the first life; nan for one that nothing reads in this life so far."""
        found = dict(zip([name for name, _ in self._signals], values, strict=True))
        return [found.get(name, nan) for name, _ in self._former]

    def _show_before(self, time_ns: int) -> None:
        while (now_ns := self._next_show_ns) < time_ns:
            self._reading_ns = now_ns
            for port, period_ns, read in self._shows:
                if now_ns % period_ns == 0:
                    self._shown.append((now_ns, port, list(read())))
            self._next_show_ns = min(now_ns - now_ns % period_ns + period_ns for _, period_ns, _ in self._shows)
        self._reading_ns = -1


def _multiple_from(time_ns: int, period_ns: int) -> int:
    """Return the first multiple of `period_ns` not before `time_ns`."""
    return -(-time_ns // period_ns) * period_ns

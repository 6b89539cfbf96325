"""Conservative windows: the conductor grants nodes the time up to which no frame that is not offered yet can arrive.

    1  t0 = the earliest instant at which any node can make an offer
    2  H  = min over media of lookahead(t0): the earliest instant at which an offer at or after t0 can reach a node
    3  one grant (H, deliveries) to each node that can make an offer before H, in parallel; no other is contacted
    4  one report from each: offers, what it shows to media, new promise, samples
    5  offers go to the media in the order (time, node name, sequence); the media run up to H

Source: Chandy and Misra 1979 (conservative simulation), with the promise as the lookahead of a node.
A medium without latency gives H = t0: the conductor then grants the instant t0 alone, in a bounded number of rounds.

Invariants:
- no frame is delivered below the horizon that its receiver was granted before;
- no window goes beyond a `stop`: all that is before it happens before its action, all else knows of it;
- the order of what happens depends on times, names and sequence numbers only, never on which report came first.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from heapq import heappop, heappush
from math import isfinite
from typing import Any

from netem.core.agenda import OFFER, SHOW, Agenda
from netem.emulator.seat import Seat
from netem.gateways.pace import Pace
from netem.media.medium import Medium
from netem.records.absence import Absence, Pause
from netem.records.events import Event
from netem.transport.hosts import Host
from netem.wire.errors import InstantLoop, NodeFailure
from netem.wire.instants import NEVER_NS
from netem.wire.messages import Grant, Hello, Life, NodeFault, Report

MAX_ROUNDS_AT_ONE_INSTANT = 100
PROGRESS_EVERY_S = 0.1


@dataclass
class Recorders:
    """The callables that receive the nodes' samples and events."""

    sample: Callable[[str, int, Sequence[float]], None] = lambda node, time_ns, values: None
    event: Callable[[Event], None] = lambda event: None
    away: Callable[[str, Absence], None] = lambda node, absence: None


@dataclass
class Conductor:
    agenda: Agenda
    host: Host
    end_ns: int
    recorders: Recorders = field(default_factory=Recorders)
    progress: Callable[[int], None] = lambda now_ns: None
    pace: Pace | None = None            # of real time; None: the run goes as fast as it can
    windows: int = 0
    grants: int = 0
    instant_rounds: int = 0
    reached_ns: int = 0
    passed_ns: int = 0                  # every arrival before it is delivered, or waits at the seat of its node
    dead_ns: dict[str, list[tuple[int, int]]] = field(default_factory=dict)     # by node: [killed, booted)
    ended: bool = False                 # no window and no stop follows
    ended_by: str = ""                  # the node that ended the run before its length, "" if none did,
    ended_because: str = ""             # and why
    counters: dict[str, dict[str, int]] = field(default_factory=dict)       # by node, from its last report
    counted: dict[str, dict[str, int]] = field(default_factory=dict)        # by node, from earlier reports
    seats: dict[str, Seat] = field(default_factory=dict)
    media: Mapping[str, Medium] = field(default_factory=dict)
    stop_ns: int = 0                    # instant of the present stop, or of the last
    _next_out_ns: int = 0
    _next_stop_ns: int = NEVER_NS       # the first of the instants in `_stops`
    _stops: list[tuple[int, bool, int, Callable[[], None]]] = field(default_factory=list)       # a heap
    _stops_so_far: int = 0
    _faulty: list[Seat] = field(default_factory=list)           # those with faults for their next grants
    _talkers: set[str] = field(default_factory=set)     # nodes that made an offer in the last instant rounds

    def admit(self, hellos: Mapping[str, Hello], media: Mapping[str, Medium]) -> None:
        """Take the nodes with their first promises, and the media; NodeFailure for a port without a medium."""
        self.media = media
        for name in sorted(hellos):
            hello = hellos[name]
            for port in hello.ports:
                if port not in media:
                    raise NodeFailure(name, f"has port {port}, which is not a medium of this run: {', '.join(media)}")
            seat = Seat(name, list(hello.ports), hello.signals, hello.soft_ns, hello.firm_ns, frozenset(hello.quiet))
            seat.renew()
            self.seats[name] = seat

    def stop_at(self, time_ns: int, action: Callable[[], None], *, first: bool = False) -> None:
        """Call `action` when all before `time_ns` has happened, and nothing at or after it.

        Actions of one instant are called in the order in which they were asked for, those with `first` before the
        others: the end of a pause has the same place before a fault that was planned and before one that is injected.
        ValueError for an instant that windows have passed. In `action`, `kill`, `pause` and `fault` may be called.
        """
        if time_ns < self.passed_ns:
            raise ValueError(f"nothing can happen at {time_ns} ns any more: the run is at {self.passed_ns} ns")
        heappush(self._stops, (time_ns, not first, self._stops_so_far, action))
        self._stops_so_far += 1
        self._next_stop_ns = self._stops[0][0]

    def fault(self, name: str, kind: str, fields: Mapping[str, Any]) -> None:
        """At a stop: let a fault act in the node, before everything else that it does at this instant."""
        seat = self.seats[name]
        if not seat.faults:
            self._faulty.append(seat)
        seat.faults.append(NodeFault(self.stop_ns, kind, dict(fields)))
        seat.earliest_ns = self.stop_ns

    def pause(self, name: str, until_ns: int, depth: int, cause: str = "") -> bool:
        """At a stop: let the node stand still; of each medium, `depth` copies that arrive wait for `until_ns`.

        A copy that finds the buffer full is `Fate.RECEIVER_PAUSED`, by `cause`. Returns False, and does nothing, if the
        node is dead or stands still already.
        """
        seat = self.seats[name]
        if seat.away_until_ns > self.stop_ns:
            return False
        pause = Pause(self.stop_ns, until_ns, depth, cause)
        self.recorders.away(name, pause)
        seat.leave(self.stop_ns, until_ns, pause)
        self.fault(name, "pause", {"until_ns": until_ns})
        if until_ns < self.end_ns:
            self.stop_at(until_ns, partial(self._go_on, seat, pause), first=True)
        return True

    def kill(self, name: str, boots_ns: int, fields: Mapping[str, Any], cause: str = "") -> bool:
        """At a stop: end the node; what arrives before `boots_ns` is `Fate.RECEIVER_GONE`, by `cause`.

        The node's last report brings its samples, events and counters, and what outlives it. Its next life begins at
        once, without a program: its plant goes on, and is recorded and shown. The program starts anew at `boots_ns`,
        or never at NEVER_NS. Returns False, and does nothing, if the node is dead already.
        """
        seat, now_ns = self.seats[name], self.stop_ns
        if seat.away_until_ns > now_ns and seat.pause is None:
            return False
        self.windows += 1
        self.grants += 1
        grant = Grant(self.windows, now_ns, False, False, seat.take(now_ns),
                      [*seat.faults, NodeFault(now_ns, "kill", {})])
        seat.faults = []
        (_, report), = self._exchange([(name, grant)])
        if report.ends is not None:
            self._end_early(name, *report.ends)
        if report.offers:
            raise self._broken_promise(seat, 0, report, now_ns)
        self._keep(seat, report, now_ns)
        seat.past.update(report.counters)
        self.counted[name] = dict(seat.past)
        self.host.kill(name)
        if seat.pause is not None:
            seat.pause.until_ns = now_ns
            seat.held.clear()
        self.recorders.away(name, Absence(now_ns, boots_ns, cause))
        self.dead_ns.setdefault(name, []).append((now_ns, boots_ns))
        seat.leave(now_ns, boots_ns, None)
        seat.life += 1
        hello = self.host.revive(name, Life(seat.life, now_ns, boots_ns, report.state or b"", list(seat.signals),
                                            sorted(seat.quiet), dict(fields)))
        seat.soft_ns, seat.firm_ns = hello.soft_ns, hello.firm_ns
        seat.renew()
        return True

    def _go_on(self, seat: Seat, pause: Pause) -> None:
        """Deliver what waited in the receive buffers of a node that stood still, unless it was killed meanwhile."""
        if seat.pause is pause:
            for arrival_ns, port, data in seat.come_back(self.stop_ns):
                self.deliver(seat.name, seat.media[port], arrival_ns, data)

    def deliver(self, receiver: str, medium: str, arrival_ns: int, data: bytes) -> None:
        """Let a frame reach `receiver`, a node or gateway, at `arrival_ns`, unless the receiver is gone by then."""
        seat = self.seats.get(receiver)
        if seat is None:
            assert self.pace is not None, f"{medium}: {receiver} is no node of this run"
            self.pace.take(receiver, arrival_ns, data)
            return
        assert arrival_ns >= seat.granted_ns, (
            f"{medium}: a frame reaches {receiver} at {arrival_ns} ns, below its horizon of {seat.granted_ns} ns")
        port = seat.ports[medium]
        if arrival_ns < seat.away_until_ns:
            if seat.pause is not None:
                seat.hold((arrival_ns, port, data))
            return
        seat.inbox.append((arrival_ns, port, data))
        if arrival_ns < seat.first_ns:
            seat.first_ns = arrival_ns
        if arrival_ns < seat.pending_ns and port not in seat.quiet:
            seat.pending_ns = arrival_ns
            if arrival_ns < seat.soft_ns:
                seat.renew()
                self._next_out_ns = min(self._next_out_ns, seat.earliest_ns)

    def run(self) -> None:
        """Run from time 0 up to `end_ns` (exclusive), then send every node its last grant.

        Raises `NodeFailure`, or `InstantLoop` for too many rounds at one instant.
        """
        agenda, seats, media = self.agenda, list(self.seats.values()), list(self.media.values())
        end_ns, instant_ns, rounds = self.end_ns, -1, 0
        next_progress_s = 0.0
        if self.pace is not None:
            self.pace.start()
        while True:
            next_out_ns = min(end_ns, self._next_stop_ns)
            for seat in seats:
                if seat.earliest_ns < next_out_ns:
                    next_out_ns = seat.earliest_ns
            self._next_out_ns = next_out_ns
            if self.pace is not None and self._wait(self.pace, min(next_out_ns, agenda.next_ns())):
                continue
            if (event_ns := agenda.next_ns()) < next_out_ns:
                while event_ns < self._next_out_ns:
                    agenda.run_before(event_ns + 1)
                    event_ns = agenda.next_ns()
            t0_ns = self._next_out_ns
            if t0_ns >= end_ns:
                break
            if t0_ns >= self._next_stop_ns:
                self._stop()
                end_ns = self.end_ns            # a node's last report may have ended the run
                continue
            horizon_ns = min(end_ns, self._next_stop_ns)
            for medium in media:
                reach_ns = medium.lookahead_ns(t0_ns)
                if reach_ns < horizon_ns:
                    horizon_ns = reach_ns
            instant = horizon_ns <= t0_ns
            if instant:
                horizon_ns = t0_ns
                rounds = rounds + 1 if instant_ns == t0_ns else 1
                instant_ns = t0_ns
                if rounds == MAX_ROUNDS_AT_ONE_INSTANT // 2:
                    self._talkers.clear()       # drops nodes that started the loop and are not in it
                self.instant_rounds += 1
                if rounds > MAX_ROUNDS_AT_ONE_INSTANT:
                    raise InstantLoop(t0_ns, sorted(self._talkers), rounds - 1)
            self._window(seats, horizon_ns, instant)
            if self.ended_by:
                agenda.run_before(self.end_ns)
                self.reached_ns = self.end_ns
                break
            self.reached_ns = horizon_ns
            agenda.run_before(horizon_ns + 1 if instant else horizon_ns)
            if (wall_s := time.monotonic()) >= next_progress_s:
                next_progress_s = wall_s + PROGRESS_EVERY_S
                self.progress(horizon_ns)
        self.ended = True
        self._finish(seats, self.end_ns)
        self.progress(self.end_ns)

    def _stop(self) -> None:
        """Call the actions of the next stop in the order that `stop_at` tells."""
        self.stop_ns = self._next_stop_ns
        self.passed_ns = max(self.passed_ns, self.stop_ns)
        while self._stops and self._stops[0][0] == self.stop_ns:
            heappop(self._stops)[3]()
        self._next_stop_ns = self._stops[0][0] if self._stops else NEVER_NS

    def _wait(self, pace: Pace, next_ns: int) -> bool:
        """Wait until the wall clock reaches `next_ns`; True if the caller has to determine the next instant again.

        A message enters when it arrived or, if the run has passed that instant, as early as it can.
        """
        reached, heard = pace.wait(next_ns)
        for name, medium, data, at_ns in heard:
            time_ns = max(at_ns, self.reached_ns, self.agenda.now_ns)
            self.agenda.at(time_ns, OFFER, name, partial(self.media[medium].offer, name, data, time_ns))
        if not reached:
            return True
        if self.agenda.next_ns() >= self._next_out_ns:
            return False
        self.agenda.run_before(next_ns + 1)
        return True

    def _window(self, seats: list[Seat], horizon_ns: int, instant: bool) -> None:
        limit_ns = horizon_ns + 1 if instant else horizon_ns
        self.passed_ns = limit_ns
        self.windows += 1
        grants = [(seat.name, Grant(self.windows, horizon_ns, instant, False,
                                    seat.take(limit_ns) if seat.first_ns < limit_ns else []))
                  for seat in seats if seat.earliest_ns < limit_ns]
        self.grants += len(grants)
        if self._faulty:
            self._hand_out_faults(grants)
        reports = self._exchange(grants)
        if self.pace is not None:
            self._note_deliveries(self.pace, grants)
        for name, report in reports:
            if report.ends is not None:
                self._end_early(name, *report.ends)
        for name, report in reports:
            seat = self.seats[name]
            if report.offers:
                if instant:
                    self._talkers.add(name)
                for sequence, (time_ns, port, data) in enumerate(report.offers):
                    if not seat.earliest_ns <= time_ns < limit_ns or not 0 <= port < len(seat.media):
                        raise self._broken_promise(seat, sequence, report, limit_ns)
                    offer = self.media[seat.media[port]].offer
                    self.agenda.at(time_ns, OFFER, name, partial(offer, name, data, time_ns))
            if report.shown:
                self._show(seat, report, limit_ns)
            self._keep(seat, report, horizon_ns)

    def _note_deliveries(self, pace: Pace, grants: list[tuple[str, Grant]]) -> None:
        """Note what nodes have taken: due at its arrival, or when they can offer again, if that is later."""
        for name, grant in grants:
            earliest_ns = self.seats[name].earliest_ns
            for arrival_ns, _, _ in grant.deliveries:
                pace.delivered(max(arrival_ns, earliest_ns))

    def _show(self, seat: Seat, report: Report, limit_ns: int) -> None:
        """Schedule what a node shows to its media, before all else that happens at the same instants."""
        for time_ns, port, values in report.shown:
            medium = self.media[seat.media[port]] if 0 <= port < len(seat.media) else None
            pose = medium.poses.get(seat.name) if medium is not None else None
            if medium is None or pose is None or len(values) != len(pose.outputs) or not all(map(isfinite, values)) \
                    or not seat.earliest_ns <= time_ns < limit_ns or time_ns % pose.period_ns:
                raise NodeFailure(seat.name, f"shows nonsense in window {report.window}: {len(values)} numbers on port "
                                  f"{port} at {time_ns} ns, expected what its medium asks for, finite, at a multiple "
                                  f"of its period in [{seat.earliest_ns}, {limit_ns}) ns", last_report=seat.standing())
            self.agenda.at(time_ns, SHOW, seat.name, partial(medium.show, seat.name, values, time_ns))

    def _hand_out_faults(self, grants: list[tuple[str, Grant]]) -> None:
        of_node = dict(grants)
        for seat in self._faulty:
            if seat.faults:
                of_node[seat.name].faults = seat.faults
                seat.faults = []
        self._faulty.clear()

    def _end_early(self, name: str, time_ns: int, because: str) -> None:
        """End the run at `time_ns` as node `name` asks, or, if the run is past that, at the next possible instant.

        Media do not carry offers made from then on; samples and events after it are not recorded.
        """
        end_ns = max(time_ns, self.reached_ns, self.agenda.now_ns + 1)
        if end_ns < self.end_ns or not self.ended_by:
            self.end_ns = min(end_ns, self.end_ns)
            self.ended_by, self.ended_because = name, because

    def _exchange(self, grants: list[tuple[str, Grant]]) -> list[tuple[str, Report]]:
        try:
            return self.host.exchange(grants)
        except NodeFailure as failure:
            seat = self.seats[failure.node]
            self.counters |= {name: self.seats[name].with_past(found) for name, found in failure.counters.items()}
            raise NodeFailure(failure.node, failure.reason, last_report=seat.standing(),
                              detail=failure.detail, others=failure.others) from None

    def _keep(self, seat: Seat, report: Report, horizon_ns: int) -> None:
        if report.soft_ns < horizon_ns:
            raise NodeFailure(seat.name, f"promises the past in window {report.window}: its next event at "
                              f"{report.soft_ns} ns, though it was granted all before {horizon_ns} ns",
                              last_report=seat.standing())
        seat.soft_ns, seat.firm_ns, seat.granted_ns = report.soft_ns, report.firm_ns, horizon_ns
        seat.earliest_ns = max(seat.firm_ns, min(seat.soft_ns, seat.pending_ns))
        if report.counters:
            self.counted[seat.name] = seat.with_past(report.counters)
        width = len(seat.signals)
        for time_ns, values in report.samples:
            if len(values) != width or not seat.sampled_ns <= time_ns <= horizon_ns:
                raise NodeFailure(seat.name, f"reports nonsense in window {report.window}: {len(values)} values of its "
                                  f"{width} signals at {time_ns} ns, expected {width} and "
                                  f"{seat.sampled_ns} <= time <= {horizon_ns} ns", last_report=seat.standing())
            seat.sampled_ns = time_ns
            if time_ns <= self.end_ns:
                self.recorders.sample(seat.name, time_ns, values)
        for time_ns, kind, detail, level in report.events:
            if not 0 <= time_ns <= horizon_ns:
                raise NodeFailure(seat.name, f"reports nonsense in window {report.window}: its event {kind[:40]!r} at "
                                  f"{time_ns} ns, expected 0 <= time <= {horizon_ns} ns", last_report=seat.standing())
            if time_ns <= self.end_ns:
                self.recorders.event(Event(time_ns, seat.name, kind, detail, level))

    def _broken_promise(self, seat: Seat, sequence: int, report: Report, limit_ns: int) -> NodeFailure:
        time_ns, port, data = report.offers[sequence]
        return NodeFailure(
            seat.name,
            f"broke its promise in window {report.window}: frame {sequence} of {len(data)} bytes on port {port} at "
            f"{time_ns} ns, expected a port below {len(seat.media)} and {seat.earliest_ns} <= time < {limit_ns} ns",
            last_report=seat.standing())

    def ask_counters(self, within_s: float) -> None:
        """After a failure, get the counters of the nodes that still answer `within_s`, with a last grant to each."""
        waiting = [seat for seat in self.seats.values() if seat.name not in self.counters]
        self.windows += 1
        grants = [(seat.name, Grant(self.windows, seat.granted_ns, False, True, [])) for seat in waiting]
        for name, report in self.host.last_words(grants, within_s):
            self.counters[name] = self.seats[name].with_past(report.counters)

    def _finish(self, seats: list[Seat], end_ns: int) -> None:
        """Send nodes their last grants: they take pending frames and report samples and counters, but make no offer."""
        self.windows += 1
        grants = [(seat.name, Grant(self.windows, end_ns, False, True, seat.take(end_ns))) for seat in seats]
        self.grants += len(grants)
        reports = self._exchange(grants)
        for name, report in reports:
            if report.ends is not None and not self.ended_by:
                self._end_early(name, *report.ends)
        for name, report in reports:
            seat = self.seats[name]
            if report.offers:
                raise self._broken_promise(seat, 0, report, end_ns)
            self._keep(seat, report, end_ns)
            self.counters[name] = seat.with_past(report.counters)

"""One shared radio channel: half-duplex nodes, frames with an airtime, and a rule by which receivers decode them.

    offer --MAC--> first bit at start --airtime--> end --receive latency--> node              on the air: [start, end)

Intervals are half open: a frame that starts when another ends does not overlap it. A frame without airtime is never on
the air: it overlaps no other frame, makes no node deaf, and deaf nodes receive it.
The nodes in range of a frame are determined once, at its start: its receivers, the nodes at which it disturbs other
frames, and those that sense it.

Invariants:
- the ledger expects, per frame, one copy for each node that is an intended receiver at the frame's start (a frame that
  never starts: at its offer);
- `_on_air` holds exactly the frames with start <= now < end, at most one of each sender;
- frames end before timers run before frames start, at one instant (the agenda's priorities).

With propagation times in the topology the intervals at each node are later by the time of the way (propagation.py).

Not modelled: several channels, a transmission that is cut short.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from random import Random
from typing import Any, ClassVar, Final

from mypy_extensions import mypyc_attr

from netem.core import link_pattern
from netem.core.agenda import END_OF_FRAME, OFFER, SHOWN, Agenda
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.decoding.on_air import OnAir
from netem.media.jammer import Jammer, cause_of
from netem.media.level_errors import LevelErrors
from netem.media.links import Links
from netem.media.mac.table import MACS
from netem.media.medium import Medium
from netem.media.observation import MediumObserver
from netem.media.propagation import Propagation
from netem.media.radio_settings import RadioSettings
from netem.media.stopped_carriers import StoppedCarriers
from netem.records.events import Event
from netem.records.ledger import Ledger
from netem.topology import Position, Site
from netem.topology.link_names import in_words
from netem.topology.reach import Reach
from netem.wire.instants import NEVER_NS
from netem.wire.level import Level

BIT_ERRORS: Final = "bit errors"        # the cause of a copy that was corrupted on the air
CARRIER_STOPPED: Final = "carrier stopped"      # a way to fail; any other is a jammer


@mypyc_attr(allow_interpreted_subclasses=True)
class BroadcastRadio(Medium):
    Settings: ClassVar = RadioSettings

    def __init__(self, name: str, settings: RadioSettings, nodes: Iterable[str] | Mapping[str, Position | None],
                 agenda: Agenda, ledger: Ledger, links: Links, rng_for: Callable[[str], Random]) -> None:
        """`nodes` are names, or names with positions [m]; raises `TopologyError` for links that do not fit them."""
        radio = settings.radio()
        at_m = {node: at for node, at in nodes.items() if at is not None} if isinstance(nodes, Mapping) else {}
        super().__init__(name, nodes)
        self.poses = settings.poses()
        self.radio = radio
        self.agenda = agenda
        self.topology = settings.topology.over(Site(self.nodes, at_m, radio.tx_power_dbm, radio.sensitivity_dbm,
                                                    lambda place: rng_for(f"media.{name}.{place}")))
        self._reach_at = self.topology.reach_at
        self._ledger = ledger
        self._links = links
        self._latency_ns = radio.receive_latency_ns
        self._checksum = radio.checksum
        self._max_bytes = radio.max_payload_bytes
        self._airtimes_ns: dict[int, int] = {}
        self._shortest_ns = radio.airtime_ns(0) + radio.receive_latency_ns
        self._numbers: dict[str, int] = {}
        self._on_air: dict[str, OnAir] = {}         # by sender
        self._carriers: dict[str, int] = {}
        self._jammers: list[Jammer] = []
        self._stopped: StoppedCarriers | None = None
        self._observer = MediumObserver()
        self._compared_ns = -1              # when the links of a topology that moves were last compared
        self._decoding = settings.decoding()
        self._overlaps_matter = self._decoding.overlaps_matter
        self._mac = MACS[settings.mac].build(self, settings.queue_frames, radio.csma,
                                             lambda node: rng_for(f"media.{name}.csma.{node}"))
        self._submit = self._mac.submit
        self._senses = self._mac.senses
        self._min_wait_ns = self._mac.min_wait_ns
        self._errors: LevelErrors | None = None
        if settings.bit_errors is not None and radio.bit_rate_bps is not None:
            self._errors = LevelErrors(settings.bit_errors, radio.bit_rate_bps, radio.header_bits,
                                       lambda link: rng_for(f"media.{name}.bit_errors.{link}"))
        self._propagation = Propagation(self, agenda) if self.topology.propagates else None

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        number = self._numbers.get(sender, 0)
        self._numbers[sender] = number + 1
        frame = Frame(self.name, sender, number, now_ns, data)
        receivers = self._reach_at(sender, now_ns).receivers
        frame.offered_to = receivers
        self._ledger.expect(len(receivers), self.name)
        if self._max_bytes is not None and len(data) > self._max_bytes:
            self.drop(frame, Fate.MALFORMED, f"longer than {self._max_bytes} bytes")
        else:
            self._submit(frame, now_ns)

    def show(self, node: str, values: Sequence[float], now_ns: int) -> None:
        if self.topology.show(node, tuple(values), now_ns) and now_ns != self._compared_ns:
            self._compared_ns = now_ns
            self.agenda.at(now_ns, SHOWN, self.name, self._compare)

    def observe(self, observer: MediumObserver) -> None:
        self._observer = observer

    def _compare(self) -> None:
        """Record the links that appear and disappear at this instant, as nodes have moved."""
        now_ns = self.agenda.now_ns
        changed = zip(("in range", "out of range"), self.topology.compare(now_ns), strict=True)
        detail = "; ".join(f"{how}: {in_words(links)}" for how, links in changed if links)
        if detail:
            self._observer.event(Event(now_ns, self.name, "links change", detail, Level.INFO))

    def lookahead_ns(self, t0_ns: int) -> int:
        """As in `Medium`, for t0_ns no later than the agenda's next event."""
        first_ns = t0_ns + self._shortest_ns
        if self._min_wait_ns and not self._mac.waiting():
            first_ns += self._min_wait_ns
        if self._propagation is not None:
            return max(min(first_ns, self._propagation.next_ns(NEVER_NS) + self._latency_ns), t0_ns)
        if self._on_air:
            first_end_ns = min([flight.end_ns for flight in self._on_air.values()])
            return max(min(first_ns, first_end_ns + self._latency_ns), t0_ns)
        return first_ns

    def finish(self, end_ns: int) -> None:
        under_way = [(flight, receiver) for flight in self._on_air.values() for receiver in flight.reach.receivers]
        for flight, receiver in under_way if self._propagation is None else self._propagation.undecided():
            self._ledger.close(flight.frame, receiver, Fate.UNFINISHED, cause="on the air")
        for frame in self._mac.waiting():
            self.drop(frame, Fate.UNFINISHED, "waiting")
        self._on_air.clear()

    def links(self, until_ns: int) -> Sequence[tuple[str, str]]:
        everyone = super().links(until_ns)
        found: set[tuple[str, str]] = set()
        for at_ns in [0, *self.topology.changes_ns(until_ns)]:
            found.update(self.topology.graph_at(at_ns))
            if len(found) == len(everyone):
                break
        return [link for link in everyone if link in found]

    def changes_ns(self, until_ns: int) -> Sequence[int]:
        return self.topology.changes_ns(until_ns)

    def take_fault(self, how: str, cause: str, of: Sequence[str], fields: Mapping[str, Any], start_ns: int,
                   end_ns: int) -> str:
        if how == CARRIER_STOPPED:
            if self._stopped is None:
                self._stopped = StoppedCarriers(self.topology.reach_at)
                self._reach_at = self._stopped.reach_at
            self._stopped.add(of[0], of[1], cause, start_ns, end_ns)
            return ""
        named = frozenset(node for pattern in fields["nodes"] for node in link_pattern.matching(pattern, self.nodes))
        lasts_ns = end_ns - start_ns
        jammer = Jammer(cause, start_ns, end_ns, fields["period_ns"] or lasts_ns, fields["burst_ns"] or lasts_ns,
                        named, fields["holds"], self.topology.position)
        self._jammers.append(jammer)
        if fields["sensed"] and self._senses:
            self.agenda.at(start_ns, OFFER, self.name, partial(self._begin_burst, jammer, 0))
        return ""

    def _begin_burst(self, jammer: Jammer, number: int) -> None:
        begins_ns, ends_ns = jammer.burst(number)
        nodes = [node for node in self.nodes if jammer.hears(node, begins_ns)]
        for node in nodes:
            self.carrier_begins(node, begins_ns)
        self.agenda.at(ends_ns, END_OF_FRAME, self.name, partial(self._end_burst, jammer, number, nodes))

    def _end_burst(self, jammer: Jammer, number: int, nodes: Sequence[str]) -> None:
        for node in nodes:
            self.carrier_ends(node, self.agenda.now_ns)
        next_ns = jammer.burst(number + 1)[0]
        if next_ns < jammer.end_ns:
            self.agenda.at(next_ns, OFFER, self.name, partial(self._begin_burst, jammer, number + 1))

    # --- calls of the MAC

    def transmitting(self, node: str) -> bool:
        return node in self._on_air

    def carriers(self, node: str) -> int:
        return self._carriers.get(node, 0)

    def start(self, frame: Frame, now_ns: int) -> None:
        sender = frame.sender
        assert sender not in self._on_air, f"{self.name}: {sender} starts a frame at {now_ns} ns during another"
        reach = self._reach_at(sender, now_ns)
        if now_ns != frame.offered_ns:
            self._ledger.expect(len(reach.receivers) - len(frame.offered_to), self.name)
        size = len(frame.data)
        airtime_ns = self._airtimes_ns.get(size)
        if airtime_ns is None:
            airtime_ns = self._airtimes_ns[size] = self.radio.airtime_ns(size)
        end_ns = now_ns + airtime_ns
        frame.on_air_ns = now_ns
        frame.end_ns = end_ns
        flight = OnAir(sender, frame, reach, now_ns, end_ns)
        if self._propagation is not None:
            self._propagation.start(flight, overlaps=self._overlaps_matter, sensed=self._senses)
        if end_ns == now_ns:
            self._receive(flight)
            self._mac.sent(sender, now_ns)
            return
        if self._on_air and self._overlaps_matter and self._propagation is None:
            for other in self._on_air.values():
                other.rivals.append(flight)
                flight.rivals.append(other)
        self._on_air[sender] = flight
        self.agenda.at(end_ns, END_OF_FRAME, sender, partial(self._end, flight))
        if self._senses:
            self._raise_carrier(flight)

    def drop(self, frame: Frame, fate: Fate, cause: str = "") -> None:
        for receiver in frame.offered_to:
            self._ledger.close(frame, receiver, fate, cause=cause)

    def _end(self, flight: OnAir) -> None:
        sender = flight.sender
        del self._on_air[sender]
        self._receive(flight)
        if self._propagation is None:
            flight.rivals.clear()       # two frames that overlap name each other: a cycle that outlives both
        if self._senses:
            self._lower_carrier(flight)
        self._mac.sent(sender, flight.end_ns)

    def _receive(self, flight: OnAir) -> None:
        frame, reach = flight.frame, flight.reach
        arrival_ns = flight.end_ns + self._latency_ns
        receive, checksum = self._links.receive, self._checksum
        for tap in self.taps:
            tap.frame(frame, flight.end_ns)
        if self._propagation is not None:
            return
        clear = not flight.rivals and not reach.too_weak and self._errors is None and not self._jammers
        for receiver in reach.receivers:
            fate = None if clear else self._fate(flight, reach, receiver)
            if fate is None and self._jammers and (
                    cause := cause_of(self._jammers, receiver, flight.start_ns, flight.end_ns)):
                self._ledger.close(frame, receiver, Fate.JAMMED, cause=cause)
            elif fate is None:
                receive(frame, receiver, arrival_ns, checksum=checksum)
            else:
                self._ledger.close(frame, receiver, fate, cause=_cause(fate, reach, receiver))

    def receive(self, flight: OnAir, receiver: str, now_ns: int) -> None:
        """Decide one copy at `now_ns`, when the last bit of `flight` has reached the receiver."""
        fate = self._fate(flight, flight.reach, receiver)
        if fate is None and self._jammers and (
                cause := cause_of(self._jammers, receiver, now_ns - (flight.end_ns - flight.start_ns), now_ns)):
            self._ledger.close(flight.frame, receiver, Fate.JAMMED, cause=cause)
        elif fate is None:
            self._links.receive(flight.frame, receiver, now_ns + self._latency_ns, checksum=self._checksum)
        else:
            self._ledger.close(flight.frame, receiver, fate, cause=_cause(fate, flight.reach, receiver))

    def carrier_begins(self, node: str, now_ns: int) -> None:
        count = self._carriers.get(node, 0)
        self._carriers[node] = count + 1
        if count == 0:
            self._mac.heard(node, now_ns)

    def carrier_ends(self, node: str, now_ns: int) -> None:
        self._carriers[node] -= 1
        if self._carriers[node] == 0:
            self._mac.cleared(node, now_ns)

    def _fate(self, flight: OnAir, reach: Reach, receiver: str) -> Fate | None:
        """Return the fate of a copy that `receiver` does not decode, else None; CUT precedes DEAF, that TOO_WEAK."""
        if receiver not in reach.too_weak:
            fate = self._decoding.fate(flight, receiver)
            if fate is None and self._errors is not None and self._errors.hit(
                    flight.sender, receiver, reach.rx_dbm[receiver], len(flight.frame.data)):
                return Fate.CORRUPTED
            return fate
        if receiver in reach.cut:
            return Fate.CUT
        if any(rival.sender == receiver for rival in flight.rivals):
            return Fate.DEAF
        return Fate.TOO_WEAK

    def _raise_carrier(self, flight: OnAir) -> None:
        for node in self._around(flight):
            self.carrier_begins(node, flight.start_ns)

    def _lower_carrier(self, flight: OnAir) -> None:
        for node in self._around(flight):
            self.carrier_ends(node, flight.end_ns)

    def _around(self, flight: OnAir) -> list[str]:
        """Return the nodes that sense the frame when its sender does: the sender, and the receivers in range."""
        if self._propagation is not None:
            return [flight.sender]
        in_range = flight.reach.in_range
        return [flight.sender, *(node for node in flight.reach.receivers if node in in_range)]


def _cause(fate: Fate, reach: Reach, receiver: str) -> str:
    """Return the cause of a copy that ended with `fate` on the air, "" if the fate says all."""
    return BIT_ERRORS if fate is Fate.CORRUPTED else reach.cut.get(receiver, "")

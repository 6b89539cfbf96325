"""A CAN bus: one frame after the other in the order of arbitration; the fate of a frame is decided at its start.

    offer --queue of the node--> arbitration --bits of the frame--> receivers one bit before the end of EOF
    [start, end of EOF) intermission 3 bits, then the next start

No later offer changes a frame on the bus, so its end, its receivers and its errors are computed at its start, and its
copies are passed to the links then. If no controller has errors pending and none can occur, this is the whole
procedure; error_handling.py has all other cases.

The nodes with a frame waiting at an instant of start contend. Receivers take a frame after all but the last bit of EOF,
its sender (`own_frames_to`) after the last one (ISO 11898-1:2015, 10.3.2).

Invariants:
- while `_waiting` is not empty, an arbitration is scheduled at `_armed_ns`, no later than the first start possible;
- those of bus_state.py.

Not modelled: propagation time, synchronization and clock tolerance; a node that joins within the first bit of a start;
overload frames, listen-only nodes, automatic answers to remote frames, a node that ends in the middle of its frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from random import Random
from typing import Any, ClassVar, Final

from mypy_extensions import mypyc_attr

from netem.core.agenda import OFFER, Agenda
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.can.admission import Admission
from netem.media.can.bit_errors import BitErrors
from netem.media.can.bus_faults import BusFaults
from netem.media.can.bus_state import BusState
from netem.media.can.controller import Controller
from netem.media.can.controller_dialogue import ControllerDialogue
from netem.media.can.controller_message import is_message
from netem.media.can.dbc_signals import DbcSignals
from netem.media.can.declared import DeclarationWatch
from netem.media.can.encoded_frame import EncodedFrame
from netem.media.can.error_handling import ErrorHandling
from netem.media.can.fault_confinement import State
from netem.media.can.frame import MalformedFrame, is_error
from netem.media.can.messages import late_messages
from netem.media.can.settings import CanSettings
from netem.media.can.transmit_queue import TransmitQueue
from netem.media.links import Links
from netem.media.medium import Medium
from netem.media.observation import MediumObserver
from netem.records.ledger import Ledger
from netem.wire.instants import NEVER_NS

ARBITRATION: Final = OFFER + 1              # after all offers of the instant


@mypyc_attr(allow_interpreted_subclasses=True)
class CanBus(Medium):
    Settings: ClassVar = CanSettings
    signals: ClassVar = (("load", "1"),)

    def __init__(self, name: str, settings: CanSettings, nodes: Iterable[str], agenda: Agenda, ledger: Ledger,
                 links: Links, rng_for: Callable[[str], Random]) -> None:
        """Raises ValueError for settings that name other nodes."""
        super().__init__(name, nodes)
        names = self.nodes
        settings.check_nodes(name, names)
        self._decoder = DbcSignals(name, settings.dbc, settings.dbc_signals) \
            if settings.dbc_signals and settings.dbc is not None else None
        settings = settings.with_declared(names)
        self.settings = settings
        self._agenda = agenda
        self._ledger = ledger
        self._links = links
        self._controllers = {
            node: Controller(node, tuple(other for other in names if other != node),
                             TransmitQueue(settings.queue, settings.queue_frames),
                             hears_itself=node in settings.own_frames_to,
                             notified=node in settings.notifications_to) for node in names}
        self._state = BusState(name, settings, self._controllers, ledger, links, self.taps)
        self._timeline, self._events, self._waiting = self._state.timeline, self._state.events, self._state.waiting
        self._errors = ErrorHandling(self._state, BitErrors(settings.bit_errors, rng_for(f"media.{name}.bit_errors")),
                                     agenda, self._arm)
        self._faults = BusFaults(self._state, self._errors, agenda, self.offer)
        self._signalling = frozenset(settings.error_frames_from)
        self._admit = Admission(settings).admit
        self._declared = DeclarationWatch(settings.messages) if settings.messages else None
        self._shortest_ns = settings.shortest_ns()
        self._armed_ns = NEVER_NS
        if self._decoder is not None:
            self.taps.append(self._decoder)
        self._notifies = bool(settings.notifications_to)
        self._dialogue = ControllerDialogue(self._state, self._errors)

    # --- as a medium

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        if self._signalling and sender in self._signalling and is_error(data):
            self._faults.signal_error(now_ns)
            return
        controller = self._controllers[sender]
        if self._notifies and controller.notified and is_message(data):
            self._dialogue.take(controller, data, now_ns)
            return
        frame = Frame(self.name, sender, controller.number, now_ns, data)
        controller.number += 1
        self._ledger.expect(controller.copies(), self.name)
        try:
            encoded = self._admit(sender, data)
        except MalformedFrame as malformed:
            self._malformed(controller, frame, str(malformed))
            return
        frame.data = encoded.data
        if self._declared is not None:
            for words in self._declared.look(sender, encoded, now_ns):
                self._events.not_as_declared(sender, encoded.data, words, now_ns)
        if controller.recovery is not None:
            if self.settings.at_bus_off == "drop":
                self._state.drop(controller, frame, Fate.BUS_OFF, "sender")
            else:
                self._queue(controller, frame, encoded)
            return
        self._queue(controller, frame, encoded)
        self._waiting[sender] = controller
        start_ns = max(now_ns, self._timeline.free_ns, controller.ready_ns)
        if start_ns < self._armed_ns:           # `_arm` checks it too; here it saves a call for most frames
            self._arm(start_ns)

    def lookahead_ns(self, t0_ns: int) -> int:
        """As in `Medium`. The links have the frame on the bus already, so only the next frame counts."""
        reach_ns = max(t0_ns, self._timeline.free_ns) + self._shortest_ns
        return max(t0_ns, min(reach_ns, self._errors.next_recovery_ns))

    def finish(self, end_ns: int) -> None:
        for controller in self._controllers.values():
            for frame in controller.queue.drain():
                self._state.drop(controller, frame, Fate.UNFINISHED, "waiting")
        self._waiting.clear()
        self._state.load.idle_until(end_ns)

    def take_fault(self, how: str, cause: str, of: Sequence[str], fields: Mapping[str, Any], start_ns: int,
                   end_ns: int) -> str:
        return self._faults.take(how, of, fields, start_ns, end_ns)

    def next_fault_ns(self, now_ns: int) -> int:
        return max(now_ns, self._timeline.free_ns)      # the fate of the frame on the bus is decided

    # --- observation

    def observe(self, observer: MediumObserver) -> None:
        self._events.observer = observer
        self._state.load.tell = lambda time_ns, load: observer.sample(self.name, time_ns, [load])
        if self._decoder is not None:
            self._decoder.sample = observer.sample
        if self.settings.queue != "fifo":
            for line in late_messages(self.settings.messages, self.settings.clock):
                self._events.may_be_late(line)

    def tables(self) -> Mapping[str, Sequence[tuple[str, str]]]:
        return {} if self._decoder is None else {table.name: table.signals for table in self._decoder.tables}

    def counters(self) -> dict[str, dict[str, int]]:
        found = {node: {f"{self.name}.{what}": count for what, count in controller.counters.items()}
                 for node, controller in self._controllers.items()}
        state, errors = self._state, self._errors
        found[self.name] = {"transmissions": state.transmissions, "error_frames": errors.error_frames,
                            "collisions": errors.collisions, "busy_us": state.load.total_ns // 1000}
        if self._decoder is not None:
            found[self.name] |= self._decoder.counters
        return found

    @property
    def busy_until_ns(self) -> int:
        """End of the intermission after the last transmission so far."""
        return self._timeline.free_ns

    def error_counters(self, node: str) -> tuple[int, int, State]:
        """Return the transmit and the receive error counter and the state, after the frame on the bus now."""
        faults = self._controllers[node].faults
        return faults.transmit_errors, faults.receive_errors, faults.state

    # --- queues

    def _queue(self, controller: Controller, frame: Frame, encoded: EncodedFrame) -> None:
        out = controller.queue.put(frame, encoded)
        if out is not None:
            controller.counters["queue_full"] += 1
            self._state.drop(controller, out[0], Fate.QUEUE_FULL, out[1])

    def _malformed(self, controller: Controller, frame: Frame, cause: str) -> None:
        controller.counters["malformed"] += 1
        self._events.malformed(controller.name, cause, frame.offered_ns)
        self._state.drop(controller, frame, Fate.MALFORMED, cause)

    # --- one transmission after the other

    def _arm(self, start_ns: int) -> None:
        """Set the next arbitration, unless an earlier one is set."""
        if start_ns < self._armed_ns:
            self._armed_ns = start_ns
            self._agenda.at(start_ns, ARBITRATION, self.name, self._arbitrate)

    def _arbitrate(self) -> None:
        now_ns = self._agenda.now_ns
        if now_ns != self._armed_ns:
            return                          # an earlier arbitration replaced this one
        self._armed_ns = NEVER_NS
        if now_ns < self._timeline.free_ns:     # a fault keeps the bus busy
            self._arm(self._timeline.free_ns)
            return
        best, senders = -1, list[Controller]()
        for controller in self._waiting.values():
            if controller.ready_ns <= now_ns:
                rank = controller.queue.waiting[0][3].rank
                if rank < best or not senders:
                    best, senders = rank, [controller]
                elif rank == best:
                    senders.append(controller)
        if senders:
            if self._notifies:
                self._dialogue.tell_losers(senders, now_ns)
            if self._errors.quiet and len(senders) == 1:
                self._send(senders[0], now_ns)
            else:
                self._errors.attempt(sorted(senders, key=lambda sender: sender.name), now_ns)
        if self._waiting:
            ready_ns = 0 if self._errors.quiet else min(controller.ready_ns for controller in self._waiting.values())
            self._arm(max(self._timeline.free_ns, ready_ns))

    def _send(self, controller: Controller, now_ns: int) -> None:
        """Carry the frame of the only contender, in which no error can occur."""
        state = self._state
        state.transmissions += 1
        encoded = controller.queue.waiting[0][3]
        frame = state.take(controller)
        taken_ns = state.carry(frame, encoded, now_ns)
        receive = self._links.receive
        for receiver in controller.receivers:
            receive(frame, receiver, taken_ns, checksum=True)
        if controller.hears_itself:
            receive(frame, controller.name, frame.end_ns, checksum=True)
        if controller.notified:
            self._errors.confirm((controller,), frame)
        for tap in self.taps:
            tap.frame(frame, taken_ns)

"""A CAN bus: frames one after the other in the order of arbitration, decided as a whole when they start.

    handed out --queue of the node--> arbitration --bits of the frame--> receivers one bit before the end of EOF
    [start, end of EOF) intermission 3 bits, then the next start

Nothing stops a frame once it is on the bus, so its end, its receivers and what goes wrong with it are settled at its
start, and what it brings reaches the links then. Where nobody has errors behind him and none can come, that is all.

Contenders are the nodes with a frame waiting at the instant of the start. Receivers take a frame when all but the last
bit of EOF have gone by, its sender (`own_frames_to`) when the last one has (ISO 11898-1:2015, 10.3.2).

Invariants:
- between two transmissions lie at least 3 bits, 11 for an error-passive node that sent the one before;
- `_waiting` holds exactly the controllers with a frame waiting that are not bus-off;
- whenever it holds one, an arbitration stands on the agenda at `_armed_ns`, not later than it can start.

Not modelled: propagation time, synchronization and clock tolerance; a node that joins within the first bit of a start;
overload frames, listen-only nodes, automatic answers to remote frames, a node that ends in the middle of its frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from random import Random
from typing import Final, Protocol

from netem.core.agenda import OFFER, TIMER, Agenda
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.can.admission import Admission
from netem.media.can.attempt import Outcome, bits_to, outcome
from netem.media.can.bit_errors import BitErrors
from netem.media.can.bit_sequence import bit_sequence
from netem.media.can.bus_events import BusEvents
from netem.media.can.bus_load import BusLoad
from netem.media.can.bus_off_recovery import BusOffRecovery
from netem.media.can.bus_timeline import BusTimeline
from netem.media.can.controller import Controller
from netem.media.can.declared import DeclarationWatch
from netem.media.can.encoded_frame import EncodedFrame, encode_frame
from netem.media.can.error_frame import ERROR_DELIMITER_BITS
from netem.media.can.error_message import state_message
from netem.media.can.fault_confinement import State
from netem.media.can.frame import ERROR_STATE, MalformedFrame
from netem.media.can.messages import late_messages
from netem.media.can.settings import CanSettings
from netem.media.can.transmit_queue import TransmitQueue
from netem.media.links import Links
from netem.media.observation import MediumObserver
from netem.records.ledger import Ledger
from netem.wire.instants import NEVER_NS

ARBITRATION: Final = OFFER + 1              # after all that is handed out at the instant
RECESSIVE_END_BITS: Final = 8               # ACK delimiter and EOF, or error delimiter


class FrameLog(Protocol):
    """What a bus was seen to carry, in order."""

    def frame(self, time_ns: int, data: bytes) -> None: ...

    def error_frame(self, time_ns: int) -> None: ...


class CanBus:
    Settings = CanSettings
    signals: Sequence[tuple[str, str]] = (("load", "1"),)

    def __init__(self, name: str, settings: CanSettings, nodes: Iterable[str], agenda: Agenda, ledger: Ledger,
                 links: Links, rng_for: Callable[[str], Random]) -> None:
        """Raises ValueError for settings that name other nodes."""
        names = tuple(nodes)
        settings.check_nodes(name, names)
        settings = settings.with_declared(names)
        self.name = name
        self.settings = settings
        self.logs: list[FrameLog] = []
        self._agenda = agenda
        self._ledger = ledger
        self._links = links
        self._timeline = BusTimeline(settings.clock)
        self._controllers = {
            node: Controller(node, tuple(other for other in names if other != node),
                             TransmitQueue(settings.queue, settings.queue_frames),
                             hears_itself=node in settings.own_frames_to) for node in names}
        self._errors = BitErrors(settings.bit_errors, rng_for(f"media.{name}.bit_errors"))
        self._safe = len(names) > 1 and not self._errors.possible
        self._quiet = self._safe            # nobody has errors behind him, and none can come
        self._admit = Admission(settings).admit
        self._declared = DeclarationWatch(settings.messages) if settings.messages else None
        self._shortest_ns = settings.shortest_ns()
        self._load = BusLoad(settings.load_window_ns)
        self._events = BusEvents(name)
        self._waiting: dict[str, Controller] = {}
        self._armed_ns = NEVER_NS
        self._next_recovery_ns = NEVER_NS   # of one that tells its node
        self.transmissions = 0
        self.error_frames = 0
        self.collisions = 0

    # --- as a medium

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        controller = self._controllers[sender]
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
                self._drop(controller, frame, Fate.BUS_OFF, "sender")
            else:
                self._queue(controller, frame, encoded)
            return
        self._queue(controller, frame, encoded)
        self._waiting[sender] = controller
        start_ns = max(now_ns, self._timeline.free_ns, controller.ready_ns)
        if start_ns < self._armed_ns:
            self._arm(start_ns)

    def lookahead_ns(self, t0_ns: int) -> int:
        """As in `Medium`. What is on the bus has been handed to the links: only the next frame counts."""
        reach_ns = max(t0_ns, self._timeline.free_ns) + self._shortest_ns
        return max(t0_ns, min(reach_ns, self._next_recovery_ns))

    def finish(self, end_ns: int) -> None:
        for controller in self._controllers.values():
            for frame in controller.queue.drain():
                self._drop(controller, frame, Fate.UNFINISHED, "waiting")
        self._waiting.clear()
        self._load.idle_until(end_ns)

    # --- what it can tell

    def observe(self, observer: MediumObserver) -> None:
        self._events.observer = observer
        self._load.tell = lambda time_ns, load: observer.sample(self.name, time_ns, [load])
        if self.settings.queue != "fifo":
            for line in late_messages(self.settings.messages, self.settings.clock):
                self._events.may_be_late(line)

    def counters(self) -> dict[str, dict[str, int]]:
        found = {node: {f"{self.name}.{what}": count for what, count in controller.counters.items()}
                 for node, controller in self._controllers.items()}
        found[self.name] = {"transmissions": self.transmissions, "error_frames": self.error_frames,
                            "collisions": self.collisions, "busy_us": self._load.total_ns // 1000}
        return found

    @property
    def busy_until_ns(self) -> int:
        """End of the intermission after the last transmission so far."""
        return self._timeline.free_ns

    def error_counters(self, node: str) -> tuple[int, int, State]:
        """Transmit and receive error counter and state, as they are after what is on the bus now."""
        faults = self._controllers[node].faults
        return faults.transmit_errors, faults.receive_errors, faults.state

    # --- queues

    def _queue(self, controller: Controller, frame: Frame, encoded: EncodedFrame) -> None:
        out = controller.queue.put(frame, encoded)
        if out is not None:
            controller.counters["queue_full"] += 1
            self._drop(controller, out[0], Fate.QUEUE_FULL, out[1])

    def _drop(self, controller: Controller, frame: Frame, fate: Fate, cause: str) -> None:
        for receiver in controller.open_copies(frame):
            self._ledger.close(frame, receiver, fate, cause=cause)
        controller.retransmissions.pop(frame.number, None)

    def _malformed(self, controller: Controller, frame: Frame, cause: str) -> None:
        controller.counters["malformed"] += 1
        self._events.malformed(controller.name, cause, frame.offered_ns)
        self._drop(controller, frame, Fate.MALFORMED, cause)

    # --- one transmission after the other

    def _arm(self, start_ns: int) -> None:
        self._armed_ns = start_ns
        self._agenda.at(start_ns, ARBITRATION, self.name, self._arbitrate)

    def _arbitrate(self) -> None:
        now_ns = self._agenda.now_ns
        if now_ns != self._armed_ns:
            return                          # another one was set before it
        self._armed_ns = NEVER_NS
        best, senders = -1, list[Controller]()
        for controller in self._waiting.values():
            if controller.ready_ns <= now_ns:
                rank = controller.queue.waiting[0][3].rank
                if rank < best or not senders:
                    best, senders = rank, [controller]
                elif rank == best:
                    senders.append(controller)
        if senders:
            if self._quiet and len(senders) == 1:
                self._send(senders[0], now_ns)
            else:
                self._attempt(sorted(senders, key=lambda sender: sender.name), now_ns)
        if self._waiting:
            ready_ns = 0 if self._quiet else min(controller.ready_ns for controller in self._waiting.values())
            start_ns = max(self._timeline.free_ns, ready_ns)
            if start_ns < self._armed_ns:
                self._arm(start_ns)

    def _carry(self, frame: Frame, encoded: EncodedFrame, now_ns: int) -> int:
        """The whole frame is on the bus from now on; returns when receivers take it."""
        timeline, clock = self._timeline, self._timeline.clock
        end_ticks = timeline.start(now_ns) + encoded.nominal_bits * clock.nominal + encoded.data_bits * clock.data
        timeline.busy_until(end_ticks)
        self._load.busy(now_ns, timeline.free_ns)
        frame.on_air_ns = now_ns
        frame.end_ns = timeline.instant(end_ticks)
        return timeline.instant(end_ticks - clock.nominal)

    def _take(self, controller: Controller) -> Frame:
        """The frame at the head of its queue got through."""
        frame = controller.queue.take()[2]
        if not controller.queue.waiting:
            del self._waiting[controller.name]
        return frame

    def _send(self, controller: Controller, now_ns: int) -> None:
        """The common case: one sender, and nothing can go wrong."""
        self.transmissions += 1
        encoded = controller.queue.waiting[0][3]
        frame = self._take(controller)
        taken_ns = self._carry(frame, encoded, now_ns)
        receive = self._links.receive
        for receiver in controller.receivers:
            receive(frame, receiver, taken_ns, checksum=True)
        if controller.hears_itself:
            receive(frame, controller.name, frame.end_ns, checksum=True)
        for log in self.logs:
            log.frame(taken_ns, frame.data)

    # --- what can go wrong

    def _attempt(self, senders: Sequence[Controller], now_ns: int) -> None:
        """`senders` won the same arbitration, mostly one."""
        lengths = [_as_sent(sender) for sender in senders]
        others = [controller for controller in self._controllers.values()
                  if controller not in senders and not controller.bus_off]
        first = lengths[0]
        hit_bit = self._errors.first_hit(self.transmissions, now_ns, first.nominal_bits + first.data_bits)
        self.transmissions += 1
        rivals = [] if hit_bit is None else self._rivals(senders, first, hit_bit, now_ns)
        found = outcome(lengths, [sender.faults.passive for sender in senders], hit_bit, acknowledged=bool(others),
                        rivals_passive=all(rival.faults.passive for rival in rivals))
        others = [other for other in others if other not in rivals]
        left = [senders[number] for number in found.left] + rivals
        silenced = [senders[number] for number in found.silenced]
        if found.clashed:
            self.collisions += 1
            self._events.same_identifier(senders, first.data, now_ns)
            for sender in senders:
                sender.counters["collisions"] += 1
        encoded = lengths[found.left[0]]
        if found.error is None:
            run_ns = self._got_through(left, silenced, others, encoded, now_ns)
        else:
            run_ns = self._destroyed(left, silenced, others, encoded, found, now_ns)
        lost = found.error is not None and found.error.sender_receives
        for sender in (*senders, *rivals):
            if sender.faults.passive and not lost:
                sender.ready_ns = self._timeline.resume_ns
            elif sender.bus_off:
                self._went_bus_off(sender, run_ns)
        for controller in self._controllers.values():
            if controller.recovery is not None:
                controller.recovery.interrupted(now_ns, run_ns)
                self._await_recovery(controller)
        self._settle()

    def _rivals(self, senders: Sequence[Controller], first: EncodedFrame, hit_bit: int,
                now_ns: int) -> list[Controller]:
        """Who contends with the senders and has sent the same bits so far, up to and including one that is hit."""
        bits = bit_sequence(first.data).bits[:hit_bit + 1]
        return [rival for rival in self._waiting.values() if rival not in senders and rival.ready_ns <= now_ns
                and bit_sequence(_as_sent(rival).data).bits[:hit_bit + 1] == bits]

    def _got_through(self, left: Sequence[Controller], silenced: Sequence[Controller], others: Sequence[Controller],
                     encoded: EncodedFrame, now_ns: int) -> int:
        """Returns the start of the recessive run at the end."""
        lead, *twins = left
        frame = self._take(lead)
        frame.data = encoded.data
        taken_ns = self._carry(frame, encoded, now_ns)
        self._hand_over(lead, frame, others, taken_ns)
        lead.retransmissions.pop(frame.number, None)
        if lead.hears_itself:
            self._links.receive(frame, lead.name, frame.end_ns, checksum=True)
        for twin in twins:
            self._twin_got_through(twin, lead, frame)
        for sender in left:
            sender.unacknowledged = False
            self._count(sender, sender.faults.sent, frame.end_ns)
        for sender in silenced:
            sender.counters["transmit_errors"] += 1
            self._count(sender, sender.faults.transmit_error, frame.end_ns)
        for other in others:
            self._count(other, other.faults.received, taken_ns)
        for log in self.logs:
            log.frame(taken_ns, frame.data)
        return frame.end_ns - self._timeline.clock.whole_ns(RECESSIVE_END_BITS)

    def _hand_over(self, lead: Controller, frame: Frame, others: Sequence[Controller], taken_ns: int) -> None:
        """Every other node's copy of a frame that those who took part have taken."""
        taking = {other.name for other in others}
        again = lead.retransmissions.get(frame.number, 0)
        if again:
            self._ledger.expect(len(lead.receivers), self.name)
        for receiver in lead.receivers:
            if receiver in taking:
                self._links.receive(frame, receiver, taken_ns, checksum=True, copy=again)
            elif self._controllers[receiver].bus_off:
                self._ledger.close(frame, receiver, Fate.BUS_OFF, copy=again, cause="receiver")
            else:
                self._ledger.close(frame, receiver, Fate.DEAF, copy=again, cause="sent the same identifier")

    def _twin_got_through(self, twin: Controller, lead: Controller, carried: Frame) -> None:
        """A frame with the same bits to the last one: on the bus there was only one."""
        frame = self._take(twin)
        frame.on_air_ns, frame.end_ns = carried.on_air_ns, carried.end_ns
        for receiver in twin.receivers:
            if frame.number not in twin.retransmissions:
                self._ledger.close(frame, receiver, Fate.COLLIDED, cause=f"same bits as a frame of {lead.name}")
        twin.retransmissions.pop(frame.number, None)
        if twin.hears_itself:
            self._links.receive(frame, twin.name, frame.end_ns, checksum=True)
        self._events.same_frame(twin, lead, frame.data, frame.on_air_ns)

    def _destroyed(self, left: Sequence[Controller], silenced: Sequence[Controller], others: Sequence[Controller],
                   encoded: EncodedFrame, found: Outcome, now_ns: int) -> int:
        """An error frame ends the transmission; its frames stay in their queues. Returns where the error delimiter
        begins."""
        error, timeline, clock = found.error, self._timeline, self._timeline.clock
        assert error is not None
        nominal_bits, data_bits = bits_to(bit_sequence(encoded.data), error)
        flag_ticks = timeline.start(now_ns) + nominal_bits * clock.nominal + data_bits * clock.data
        delimiter_ticks = flag_ticks + error.flag_bits * clock.nominal
        end_ticks = delimiter_ticks + ERROR_DELIMITER_BITS * clock.nominal
        timeline.busy_until(end_ticks)
        self._load.busy(now_ns, timeline.free_ns)
        error_ns = timeline.instant(flag_ticks)
        for sender in left:
            frame = sender.queue.waiting[0][2]
            frame.on_air_ns, frame.end_ns = now_ns, timeline.instant(end_ticks)
        if error.received:
            frame = left[0].queue.waiting[0][2]
            frame.data = encoded.data
            self._hand_over(left[0], frame, others, timeline.instant(flag_ticks - clock.nominal))
            left[0].retransmissions[frame.number] = left[0].retransmissions.get(frame.number, 0) + 1
        self._count_errors(left, silenced, others, found, error_ns)
        for sender in left:
            if not found.unacknowledged:
                self._events.error_frame(sender, encoded.data, error, error_ns)
            else:
                sender.counters["no_acknowledgement"] += 1
                if not sender.unacknowledged:
                    self._events.unacknowledged(sender, encoded.data, error_ns)
                sender.unacknowledged = True
        for log in self.logs:
            log.error_frame(error_ns)
        return timeline.instant(delimiter_ticks)

    def _count_errors(self, left: Sequence[Controller], silenced: Sequence[Controller], others: Sequence[Controller],
                      found: Outcome, error_ns: int) -> None:
        error = found.error
        assert error is not None
        self.error_frames += 1
        for sender in left:
            sender.counters["transmit_errors"] += 1
            if error.sender_counts:
                self._count(sender, sender.faults.transmit_error, error_ns)
            elif error.sender_receives:
                self._count(sender, sender.faults.receive_error, error_ns)
        for sender in silenced:
            sender.counters["transmit_errors"] += 1
            self._count(sender, sender.faults.transmit_error, error_ns)
        for other in others:
            if error.acknowledged:
                self._count(other, other.faults.received, error_ns)
            if error.receivers_count:
                self._count(other, other.faults.receive_error, error_ns)

    def _count(self, controller: Controller, event: Callable[[], None], time_ns: int) -> None:
        """Change the controller's error counters, and tell a change of state."""
        before = controller.faults.state
        event()
        state = controller.faults.state
        if state is not before:
            controller.counters[state.name.lower()] += 1
            self._events.state(controller, time_ns)
            if controller.name in self.settings.error_messages_to:
                told_ns = time_ns if before is State.BUS_OFF else self._timeline.free_ns
                self._links.tell(controller.name, self.name, told_ns, state_message(controller.faults, before))

    def _went_bus_off(self, controller: Controller, run_ns: int) -> None:
        self._waiting.pop(controller.name, None)
        if self.settings.at_bus_off == "drop":
            for frame in controller.queue.drain():
                self._drop(controller, frame, Fate.BUS_OFF, "sender")
        controller.recovery = BusOffRecovery(self._timeline.clock, run_ns + self.settings.restart_delay_ns, run_ns)

    def _await_recovery(self, controller: Controller) -> None:
        if self.settings.recovery == "automatic" and controller.recovery is not None:
            due_ns = controller.recovery.due_ns()
            self._agenda.at(due_ns, TIMER, controller.name, partial(self._recover, controller, due_ns))

    def _settle(self) -> None:
        """What follows from all controllers together."""
        self._quiet = self._safe and all(controller.faults.calm for controller in self._controllers.values())
        if self.settings.error_messages_to and self.settings.recovery == "automatic":
            self._next_recovery_ns = min((controller.recovery.due_ns() for controller in self._controllers.values()
                                          if controller.recovery is not None), default=NEVER_NS)

    def _recover(self, controller: Controller, due_ns: int) -> None:
        if controller.recovery is None or controller.recovery.due_ns() != due_ns:
            return                          # frames have come in between
        controller.recovery = None
        controller.unacknowledged = False
        self._count(controller, controller.faults.recovered, due_ns)
        self._settle()
        if controller.queue:
            self._waiting[controller.name] = controller
            start_ns = max(due_ns, self._timeline.free_ns)
            if start_ns < self._armed_ns:
                self._arm(start_ns)


def _as_sent(sender: Controller) -> EncodedFrame:
    """A CAN FD frame says that its sender is error-passive."""
    encoded = sender.queue.waiting[0][3]
    if not (encoded.fd and sender.faults.passive) or encoded.data[5] & ERROR_STATE:
        return encoded
    return encode_frame(encoded.data[:5] + bytes((encoded.data[5] | ERROR_STATE,)) + encoded.data[6:])

"""Transmissions with possible errors: bit errors, no acknowledgement, one identifier at two nodes, bus-off.

    arbitration won --outcome--> got through, or destroyed by an error frame --error counters--> states, recovery

A transmission is computed at its start. Of several senders, those that are `left` send to its end and those `silenced`
stop at a bit that they read inverted. A destroyed frame stays in its queue.

While no controller has errors pending and none can occur, `quiet` is True and the bus does not use this file.
Source: ISO 11898-1:2015, 10.11 to 12.1; the files that this one combines name the clauses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from netem.core.agenda import TIMER, Agenda
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.can.attempt import Outcome, bits_to, outcome
from netem.media.can.bit_errors import BitErrors
from netem.media.can.bit_sequence import bit_sequence
from netem.media.can.bus_off_recovery import BusOffRecovery
from netem.media.can.bus_state import BusState
from netem.media.can.controller import Controller
from netem.media.can.controller_message import CAUSES, ControllerMessage, Kind, encode
from netem.media.can.encoded_frame import EncodedFrame, encode_frame
from netem.media.can.error_frame import ERROR_DELIMITER_BITS, FLAG_BITS, Cause, ErrorFrame
from netem.media.can.error_message import state_message
from netem.media.can.fault_confinement import State
from netem.media.can.frame import ERROR_STATE, unpack
from netem.media.can.stuck_dominant import StuckDominant, Window
from netem.wire.instants import NEVER_NS

RECESSIVE_END_BITS: Final = 8               # ACK delimiter and EOF, or error delimiter


class ErrorHandling:
    """Carries out transmissions with errors; `arm` sets the next arbitration, unless an earlier one is set."""

    def __init__(self, state: BusState, errors: BitErrors, agenda: Agenda, arm: Callable[[int], None]) -> None:
        self.error_frames = 0
        self.collisions = 0
        self.quiet = self._safe = len(state.controllers) > 1 and not errors.possible
        self._stuck: StuckDominant | None = None        # windows in which the bus is dominant, if a fault says so
        self._struck: tuple[int, list[Controller]] = -1, []     # flag after the last frame destroyed, its senders
        self.next_recovery_ns = NEVER_NS    # next recovery of a controller that reports it to its node
        self._state, self._errors, self._agenda, self._arm = state, errors, agenda, arm
        self._settings, self._links, self._ledger = state.settings, state.links, state.ledger
        self._controllers, self._waiting = state.controllers, state.waiting
        self._timeline, self._load, self._events = state.timeline, state.load, state.events

    def attempt(self, senders: Sequence[Controller], now_ns: int) -> None:
        """Carry out the transmission of `senders`, all of which won the arbitration: several have one identifier."""
        lengths = [_as_sent(sender) for sender in senders]
        others = [controller for controller in self._controllers.values()
                  if controller not in senders and not controller.bus_off]
        first = lengths[0]
        hit_bit = self._errors.first_hit(self._state.transmissions, now_ns, first.nominal_bits + first.data_bits)
        self._state.transmissions += 1
        if self._stuck is not None:
            hit_bit = min((hit for hit in (hit_bit, self._stuck.first_hit(first, now_ns)) if hit is not None),
                          default=None)
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
        """Return the controllers that contend with the senders and whose bits are equal up to and including the hit."""
        bits = bit_sequence(first.data).bits[:hit_bit + 1]
        return [rival for rival in self._waiting.values() if rival not in senders and rival.ready_ns <= now_ns
                and bit_sequence(_as_sent(rival).data).bits[:hit_bit + 1] == bits]

    def _got_through(self, left: Sequence[Controller], silenced: Sequence[Controller], others: Sequence[Controller],
                     encoded: EncodedFrame, now_ns: int) -> int:
        """Complete a transmission without an error frame; return the start [ns] of the recessive bits at its end."""
        lead, *twins = left
        frame = self._state.take(lead)
        frame.data = encoded.data
        taken_ns = self._state.carry(frame, encoded, now_ns)
        self._hand_over(lead, frame, others, taken_ns)
        lead.retransmissions.pop(frame.number, None)
        if lead.hears_itself:
            self._links.receive(frame, lead.name, frame.end_ns, checksum=True)
        if self._settings.notifications_to:
            self.confirm(left, frame)
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
        for tap in self._state.taps:
            tap.frame(frame, taken_ns)
        return frame.end_ns - self._timeline.clock.whole_ns(RECESSIVE_END_BITS)

    def _hand_over(self, lead: Controller, frame: Frame, others: Sequence[Controller], taken_ns: int) -> None:
        """Pass the copies of a frame to the links for `others`, which take it, and close those of all other nodes."""
        taking = {other.name for other in others}
        again = lead.retransmissions.get(frame.number, 0)
        if again:
            self._ledger.expect(len(lead.receivers), self._state.name)
        for receiver in lead.receivers:
            if receiver in taking:
                self._links.receive(frame, receiver, taken_ns, checksum=True, copy=again)
            elif self._controllers[receiver].bus_off:
                self._ledger.close(frame, receiver, Fate.BUS_OFF, copy=again, cause="receiver")
            else:
                self._ledger.close(frame, receiver, Fate.DEAF, copy=again, cause="sent the same identifier")

    def _twin_got_through(self, twin: Controller, lead: Controller, carried: Frame) -> None:
        """Remove the frame of a sender whose bits all equalled those of `lead`: the bus carried one frame only."""
        frame = self._state.take(twin)
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
        """End the transmission with an error frame; the frames stay in their queues.

        Returns the start [ns] of the error delimiter.
        """
        error, timeline, clock = found.error, self._timeline, self._timeline.clock
        assert error is not None
        nominal_bits, data_bits = bits_to(bit_sequence(encoded.data), error)
        flag_ticks = timeline.start(now_ns) + nominal_bits * clock.nominal + data_bits * clock.data
        delimiter_ticks = flag_ticks + error.flag_bits * clock.nominal
        end_ticks = delimiter_ticks + ERROR_DELIMITER_BITS * clock.nominal
        timeline.busy_until(end_ticks)
        self._load.busy(now_ns, timeline.free_ns)
        error_ns = timeline.instant(flag_ticks)
        self._struck = error_ns, [] if error.sender_receives else [*left]
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
        for tap in self._state.taps:
            tap.error_frame(self._state.name, error_ns)
        if self._settings.notifications_to:
            self._tell_error(left, encoded, error)
        return timeline.instant(delimiter_ticks)

    def confirm(self, senders: Sequence[Controller], frame: Frame) -> None:
        """Tell the senders that get notifications that their frame got through: at the end of the frame."""
        for sender in senders:
            if sender.notified:
                self._links.tell(sender.name, self._state.name, frame.end_ns, encode(ControllerMessage(
                    Kind.CONFIRM, unpack(frame.data).can_id)))

    def _tell_error(self, left: Sequence[Controller], encoded: EncodedFrame, error: ErrorFrame) -> None:
        """Tell the nodes that get notifications of an error frame, at the end of its intermission."""
        senders = [] if error.sender_receives else left
        by_all = error.cause in (Cause.STUFF, Cause.FORM)
        can_id = unpack(encoded.data).can_id
        for controller in self._controllers.values():
            sends = controller in senders           # one that this error has taken off the bus is told too
            if controller.notified and (sends or not controller.bus_off):
                self._links.tell(controller.name, self._state.name, self._timeline.free_ns, encode(ControllerMessage(
                    Kind.BUS_ERROR, can_id, CAUSES.index(error.cause), int(sends or by_all), int(sends))))

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
        """Change the controller's error counters by `event`, and report a change of state."""
        before = controller.faults.state
        event()
        state = controller.faults.state
        if state is not before:
            controller.counters[state.name.lower()] += 1
            self._events.state(controller, time_ns)
            if controller.name in self._settings.error_messages_to:
                told_ns = time_ns if before is State.BUS_OFF else self._timeline.free_ns
                self._links.tell(controller.name, self._state.name, told_ns, state_message(controller.faults, before))

    # --- faults

    def force_bus_off(self, controller: Controller, now_ns: int) -> str:
        """Take a controller off the bus; return why that is impossible, or "". A frame on the bus is completed."""
        if controller.bus_off:
            return "its controller is bus-off already"
        run_ns = max(now_ns, self._timeline.free_ns)
        self._count(controller, controller.faults.forced_off, run_ns)
        self._went_bus_off(controller, run_ns)
        self._await_recovery(controller)
        self._settle()
        return ""

    def expect_stuck(self, window: Window) -> None:
        """Know before it begins that the bus will be dominant, so that a frame that it meets is destroyed."""
        if self._stuck is None:
            self._stuck = StuckDominant(self._timeline.clock)
        self._stuck.windows.append(window)
        self.quiet = self._safe = False

    def stuck(self, window: Window) -> None:
        """At its start: hold the bus dominant over the window, and count what nodes count meanwhile."""
        start_ns, end_ns = window
        timeline, clock = self._timeline, self._timeline.clock
        flag_ns, senders = self._struck
        if flag_ns < start_ns:                              # no frame was destroyed: the bus was idle
            flag_ns, senders = start_ns + clock.ns(FLAG_BITS * clock.nominal), []
            if end_ns < flag_ns:
                return
            self.error_frames += 1
            for controller in self._controllers.values():
                if not controller.bus_off:
                    self._count(controller, controller.faults.receive_error, flag_ns)
        busy_ns = timeline.free_ns
        dominant_ns = max(end_ns, flag_ns + clock.ns(FLAG_BITS * clock.nominal))
        base = timeline.start(start_ns)
        timeline.busy_until(base + (dominant_ns - start_ns) * clock.ticks_per_ns
                            + ERROR_DELIMITER_BITS * clock.nominal)
        self._load.busy(max(start_ns, busy_ns), timeline.free_ns)
        self._count_dominant(flag_ns, dominant_ns, senders)
        for controller in self._controllers.values():
            if controller in senders and controller.bus_off and controller.recovery is None:
                self._went_bus_off(controller, dominant_ns)
            elif controller.faults.passive and controller in senders:
                controller.ready_ns = timeline.resume_ns
            if controller.recovery is not None:
                controller.recovery.interrupted(min(start_ns, dominant_ns), dominant_ns)
                self._await_recovery(controller)
        self._settle()

    def _count_dominant(self, flag_ns: int, end_ns: int, senders: Sequence[Controller]) -> None:
        """Count every sequence of 8 dominant bits after an error flag, until no counter changes any more."""
        clock = self._timeline.clock
        sequence_ns = flag_ns + clock.ns((FLAG_BITS + 8) * clock.nominal)
        number = 1
        while sequence_ns <= end_ns:
            counting = [controller for controller in self._controllers.values() if not controller.bus_off
                        and (controller in senders or not controller.faults.passive)]
            if not counting:
                return
            for controller in counting:
                self._count(controller, controller.faults.transmit_error if controller in senders
                            else controller.faults.dominant_after_flag, sequence_ns)
            number += 1
            sequence_ns = flag_ns + clock.ns((FLAG_BITS + 8 * number) * clock.nominal)

    def _went_bus_off(self, controller: Controller, run_ns: int) -> None:
        self._waiting.pop(controller.name, None)
        if self._settings.at_bus_off == "drop":
            for frame in controller.queue.drain():
                self._state.drop(controller, frame, Fate.BUS_OFF, "sender")
        controller.recovery = BusOffRecovery(self._timeline.clock, run_ns + self._settings.restart_delay_ns, run_ns)

    def _await_recovery(self, controller: Controller) -> None:
        if self._settings.recovery == "automatic" and controller.recovery is not None:
            due_ns = controller.recovery.due_ns()
            self._agenda.at(due_ns, TIMER, controller.name, partial(self._recover, controller, due_ns))

    def _settle(self) -> None:
        """Recompute whether the error-free path applies, and the next recovery."""
        self.quiet = self._safe and all(controller.faults.calm for controller in self._controllers.values())
        if self._settings.error_messages_to and self._settings.recovery == "automatic":
            self.next_recovery_ns = min((controller.recovery.due_ns() for controller in self._controllers.values()
                                         if controller.recovery is not None), default=NEVER_NS)

    def _recover(self, controller: Controller, due_ns: int) -> None:
        if controller.recovery is None or controller.recovery.due_ns() != due_ns:
            return                          # frames have interrupted the recovery, so it is due later
        controller.recovery = None
        controller.unacknowledged = False
        self._count(controller, controller.faults.recovered, due_ns)
        self._settle()
        if controller.queue:
            self._waiting[controller.name] = controller
            self._arm(max(due_ns, self._timeline.free_ns))


def _as_sent(sender: Controller) -> EncodedFrame:
    """Return the frame at the head of the queue; in a CAN FD frame the bit ESI shows an error-passive sender."""
    encoded = sender.queue.waiting[0][3]
    if not (encoded.fd and sender.faults.passive) or encoded.data[5] & ERROR_STATE:
        return encoded
    return encode_frame(encoded.data[:5] + bytes((encoded.data[5] | ERROR_STATE,)) + encoded.data[6:])

"""What a controller tells its node about single frames, and takes from it, for the nodes in `notifications_to`.

A frame that loses arbitration while its node asked for one attempt is discarded; the node learns it at the end of the
bit at which it read dominant and sent recessive. The nodes whose frames wait on retry as always.

Not modelled: an error within the arbitration field, after which a node that had not lost yet is told all the same.
"""

from __future__ import annotations

from collections.abc import Sequence

from netem.core.fate import Fate
from netem.media.can.bit_sequence import bit_sequence
from netem.media.can.bus_state import BusState
from netem.media.can.controller import Controller
from netem.media.can.controller_message import BUS_OFF, ControllerMessage, Kind, decode, encode
from netem.media.can.error_handling import ErrorHandling
from netem.media.can.frame import MalformedFrame, unpack
from netem.media.can.settings import SHORTEST_LOSS_BITS


class ControllerDialogue:
    def __init__(self, state: BusState, errors: ErrorHandling) -> None:
        self._state, self._errors = state, errors

    def take(self, controller: Controller, data: bytes, now_ns: int) -> None:
        """Take a message from a controller's own node; one that says nothing is counted as malformed."""
        try:
            message = decode(unpack(data))
        except MalformedFrame:
            message = None
        if message is None:
            controller.counters["malformed"] += 1
        elif message.kind is Kind.ONE_SHOT:
            controller.one_shot = message.first == 1
        elif message.kind is Kind.STATUS:
            if message.first == BUS_OFF and not controller.bus_off:
                self._errors.force_bus_off(controller, now_ns)
        elif message.kind is Kind.WAKEUP:
            timeline = self._state.timeline
            told_ns = max(now_ns, timeline.free_ns) + timeline.clock.whole_ns(SHORTEST_LOSS_BITS)
            for other in self._state.controllers.values():
                if other.notified and other is not controller:
                    self._tell(other, told_ns, ControllerMessage(Kind.WAKEUP))

    def tell_losers(self, senders: Sequence[Controller], now_ns: int) -> None:
        """Discard the frames that lose arbitration against `senders`, all of one identifier, if their nodes ask so."""
        losers = [controller for controller in self._state.waiting.values()
                  if controller.one_shot and controller.ready_ns <= now_ns and controller not in senders]
        for loser in losers:
            timeline = self._state.timeline
            winner_bits = bit_sequence(senders[0].queue.waiting[0][3].data).bits
            encoded = loser.queue.waiting[0][3]
            pairs = zip(winner_bits, bit_sequence(encoded.data).bits, strict=False)
            bit = next((number for number, (won, lost) in enumerate(pairs) if won != lost), 0)
            frame = self._state.take(loser)
            self._state.drop(loser, frame, Fate.ARBITRATION_LOST, "one attempt")
            told_ns = timeline.instant(timeline.start(now_ns) + (bit + 1) * timeline.clock.nominal)
            self._tell(loser, told_ns, ControllerMessage(Kind.LOST, unpack(encoded.data).can_id, bit))

    def _tell(self, controller: Controller, told_ns: int, message: ControllerMessage) -> None:
        self._state.links.tell(controller.name, self._state.name, told_ns, encode(message))

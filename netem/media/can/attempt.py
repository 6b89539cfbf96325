"""How one transmission ends: who is on the bus to its end, who fell silent, and which error frame there is, if any.

Of several errors the first one counts, since the others lie in a frame that is over. The acknowledgement comes from
any node that takes part and does not send.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from netem.media.can.bit_sequence import BitSequence, bit_sequence
from netem.media.can.encoded_frame import EncodedFrame
from netem.media.can.error_frame import ErrorFrame, after_bit_error, without_acknowledgement
from netem.media.can.same_identifier import clash


@dataclass(frozen=True)
class Outcome:
    """Numbers of the frames, as in `Clash`; `error` None: the frame got through."""

    left: tuple[int, ...]
    silenced: tuple[int, ...] = ()
    error: ErrorFrame | None = None
    unacknowledged: bool = False
    clashed: bool = False               # they differ beyond the arbitration field, and got as far as that


def outcome(frames: Sequence[EncodedFrame], passive: Sequence[bool], hit_bit: int | None, *, acknowledged: bool,
            rivals_passive: bool = True) -> Outcome:
    """Of frames with the same arbitration field (mostly one) that start together; `passive`: their senders are.

    `hit_bit` is seen inverted by everybody; rivals in arbitration who sent that bit too are `rivals_passive`, all of
    them, or answer with an active flag.
    """
    if len(frames) == 1 and hit_bit is None and acknowledged:
        return Outcome((0,))
    sequences = [bit_sequence(frame.data) for frame in frames]
    met = clash(sequences, passive)
    first = sequences[met.left[0]]
    silent = all(passive[number] for number in met.left)
    error, unacknowledged, clashed = met.error, False, met.clashed
    if hit_bit is not None and hit_bit < len(first) and (error is None or hit_bit < error.last_bit):
        error = after_bit_error(first, hit_bit, passive=silent and rivals_passive)
        clashed = bool(met.silenced)
    if not acknowledged:
        missing = without_acknowledgement(first, passive=silent)
        if error is None or missing.last_bit < error.last_bit:
            error, unacknowledged = missing, True
    return Outcome(met.left, met.silenced, error, unacknowledged, clashed)


def bits_to(sequence: BitSequence, error: ErrorFrame) -> tuple[int, int]:
    """(nominal, data) bits from SOF to the last one before the error flags."""
    if error.sender_receives:               # nobody sends, so nobody changes the rate
        return error.last_bit + 1, 0
    return sequence.rates_up_to(error.last_bit)

"""Determines how one transmission ends: which senders stay to its end, which stop before, and the error frame, if any.

Of several errors the first one counts, as it ends the frame. Any node that takes part and does not send acknowledges.
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
    """The end of a transmission. `left` and `silenced` are as in `Clash`; `error` is None if the frame was received."""

    left: tuple[int, ...]
    silenced: tuple[int, ...] = ()
    error: ErrorFrame | None = None
    unacknowledged: bool = False
    clashed: bool = False               # the frames differ after the arbitration field, and no earlier error ended them


def outcome(frames: Sequence[EncodedFrame], passive: Sequence[bool], hit_bit: int | None, *, acknowledged: bool,
            rivals_passive: bool = True) -> Outcome:
    """Return the end of a transmission of frames (mostly one) with the same arbitration field that start together.

    `passive` tells which of their senders are error-passive. All nodes see `hit_bit` inverted. `rivals_passive` is
    false if a node that lost arbitration, but sent that bit too, is error-active and answers with an active flag.
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
    """(nominal, data) bits from SOF to the last bit before the error flags."""
    if error.sender_receives:               # no node sends, so the rate does not change
        return error.last_bit + 1, 0
    return sequence.rates_up_to(error.last_bit)

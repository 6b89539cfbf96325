"""The error frame that follows an inverted bit: which nodes detect the error at which bit, and how long it lasts.

    .. bit k inverted | error flags, 6 to 12 bits superposed | error delimiter 8 | intermission 3

The first node that detects the error sends its flag from the next bit on: dominant while error-active, recessive while
error-passive. The others detect it at k too (a stuff bit or a bit of fixed form) or by the flag, and then send theirs.

    field of bit k                       detected by
    arbitration, recessive, no stuff     the sender takes it for lost arbitration and stops sending: all nodes detect a
                                         stuff error as receivers at bit k + 6
    arbitration, a recessive stuff bit   all at k; the sender's counter stays (12.1.4.2, exception 2)
    other bits up to the CRC sequence    the sender at k; receivers at k (stuff bit) or by the flag
    ACK slot                             all at k: the sender misses the acknowledgement
    delimiters, end of frame             all at k, as a form error
    last bit of the end of frame         the sender at k; receivers have taken the frame and send an overload flag

Source: ISO 11898-1:2015, 10.4.4, 10.9, 10.11.

Not modelled: bits that only some nodes see inverted, errors within error frames and in the intermission, other overload
frames, the protocol exception of a recessive `res` bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

from netem.media.can.bit_sequence import BitSequence, Field
from netem.media.can.receiver import Receiver

FLAG_BITS: Final = 6
ERROR_DELIMITER_BITS: Final = 8
FIXED_FORM: Final = (Field.CRC_DELIMITER, Field.ACK_DELIMITER, Field.EOF)


class Cause(Enum):
    BIT = "bit error"
    STUFF = "stuff error"
    FORM = "form error"
    ACK = "no acknowledgement"


@dataclass(frozen=True)
class ErrorFrame:
    cause: Cause
    field: Field                    # field of the error
    last_bit: int                   # the last bit before the first flag, from SOF = 0
    flag_bits: int                  # superposed flags, 6..12 bits
    sender_counts: bool = True      # the sender's transmit error counter + 8
    sender_receives: bool = False   # the sender had stopped sending: its receive error counter + 1, as the others'
    receivers_count: bool = True    # the receivers' receive error counters + 1
    received: bool = False          # the receivers have taken the frame, and the sender will repeat it

    @property
    def acknowledged(self) -> bool:
        """True if the receivers had acknowledged the frame before, which lowers their receive error counters by 1."""
        return self.field in (Field.ACK_DELIMITER, Field.EOF)


def after_bit_error(sequence: BitSequence, bit: int, *, passive: bool) -> ErrorFrame:
    """The error frame if all nodes see bit `bit` (SOF = 0) inverted; `passive` if the sender is error-passive."""
    field = sequence.fields[bit]
    if field is Field.EOF and bit == len(sequence) - 1:
        return ErrorFrame(Cause.BIT, field, bit, FLAG_BITS, receivers_count=False, received=True)
    if field in FIXED_FORM:
        return ErrorFrame(Cause.FORM, field, bit, FLAG_BITS)
    if field is Field.ACK_SLOT:
        return ErrorFrame(Cause.ACK, field, bit, FLAG_BITS)
    if field is Field.ARBITRATION and sequence.bits[bit] == "1":
        if bit in sequence.stuff:
            return ErrorFrame(Cause.STUFF, field, bit, FLAG_BITS, sender_counts=False)
        return ErrorFrame(Cause.STUFF, field, bit + 6, FLAG_BITS, sender_counts=False, sender_receives=True)
    if bit == 0 and passive:                    # no receiver has seen the start of the frame
        return ErrorFrame(Cause.BIT, field, bit, FLAG_BITS, receivers_count=False)
    seen = sequence.bits[:bit] + ("1" if sequence.bits[bit] == "0" else "0")
    return ErrorFrame(Cause.BIT, field, bit, flag_bits(seen, passive=passive))


def without_acknowledgement(sequence: BitSequence, *, passive: bool) -> ErrorFrame:
    """Return the error frame if no node drives the ACK slot; an error-passive sender does not count the error.

    Source: 12.1.4.2, exception 1.
    """
    slot = sequence.first(Field.ACK_SLOT)
    return ErrorFrame(Cause.ACK, Field.ACK_SLOT, slot, FLAG_BITS, sender_counts=not passive, receivers_count=False)


def flag_bits(seen: str, *, passive: bool) -> int:
    """Length of the superposed flags, of which the first begins after the bits `seen`; the last of these is wrong.

    A `passive` flag is recessive: the receivers detect the error by themselves, by the checksum at the latest.
    """
    receiver = Receiver()
    for level in seen:
        receiver.sees(level)
    alone = 0                       # bits of the first flag before the receivers detect the error
    while not receiver.wrong:
        receiver.sees("1" if passive else "0")
        alone += 1
    return alone + FLAG_BITS

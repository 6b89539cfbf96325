"""Two controllers that send the same identifier at once both win arbitration, which CAN forbids and cannot prevent.

Both go on. At the first bit in which their frames differ, the controller that sends recessive detects a bit error.
While it is error-active its flag destroys the frame for all nodes, and both retransmit at the same instant; once it is
error-passive its flag is recessive and the other frame is received. Receivers see equal frames as one frame.

Source: ISO 11898-1:2015, 10.4.2.1; K.-T. Cho, K. G. Shin, "Error handling of in-vehicle networks makes them
vulnerable", CCS 2016, which uses it as an attack.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from netem.media.can.bit_sequence import BitSequence
from netem.media.can.error_frame import Cause, ErrorFrame, flag_bits


@dataclass(frozen=True)
class Clash:
    """The result of frames that start together, by their index.

    The senders of `silenced` stopped; those of `left` sent to the end or to the error frame. `clashed` if the frames
    were not all equal.
    """

    left: tuple[int, ...]
    silenced: tuple[int, ...]
    error: ErrorFrame | None

    @property
    def clashed(self) -> bool:
        return self.error is not None or bool(self.silenced)


def clash(sequences: Sequence[BitSequence], passive: Sequence[bool]) -> Clash:
    """Compare frames with the same arbitration field that start together; `passive` tells which senders are."""
    left, silenced = list(range(len(sequences))), list[int]()
    while (bit := _first_difference([sequences[number] for number in left])) is not None:
        recessive = [number for number in left if sequences[number].bits[bit] == "1"]
        dominant = [number for number in left if number not in recessive]
        if not all(passive[number] for number in recessive):
            sequence = sequences[dominant[0]]
            flags = flag_bits(sequence.bits[:bit + 1], passive=False)
            return Clash(tuple(left), tuple(silenced),
                         ErrorFrame(Cause.BIT, sequence.fields[bit], bit, flags))
        silenced += recessive
        left = dominant
    return Clash(tuple(left), tuple(sorted(silenced)), None)


def _first_difference(sequences: Sequence[BitSequence]) -> int | None:
    for bit, levels in enumerate(zip(*(sequence.bits for sequence in sequences), strict=False)):
        if len(set(levels)) > 1:
            return bit
    return None

"""Two controllers win the same arbitration: they sent one identifier at once, which CAN forbids and cannot prevent.

Both go on. At the first bit in which they differ, who sends recessive sees dominant: a bit error. While that one is
error-active its flag destroys the frame for all, and both try again, at the same instant; once it is error-passive
its flag is recessive and the other frame gets through. Frames that are equal to the last bit are one frame to all.

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
    """Numbers of the frames, in the order given: `silenced` fell silent, `left` were on the bus to the end or to the
    error frame. `clashed`: they were not all equal."""

    left: tuple[int, ...]
    silenced: tuple[int, ...]
    error: ErrorFrame | None

    @property
    def clashed(self) -> bool:
        return self.error is not None or bool(self.silenced)


def clash(sequences: Sequence[BitSequence], passive: Sequence[bool]) -> Clash:
    """What becomes of frames with the same arbitration field that start together; `passive`: their senders are."""
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

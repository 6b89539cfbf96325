"""A bus that is dominant over a window, as by a short circuit or a transceiver that holds it: no frame gets through.

    frame | error flag 6 | dominant to the end of the window | delimiter 8 | intermission 3
                       +8 bits: TEC + 8 of the sender, REC + 8 of the others, and again every 8 bits

The sender of a frame that is under way reads its first recessive bit within the window as dominant, and sends an error
flag. On an idle bus all nodes take the sixth dominant bit for a stuff error, as receivers. After the flag every node
counts an error for each sequence of 8 further dominant bits, until it is bus-off (sender) or error-passive (others).
Source: ISO 11898-1:2015, 12.1.4.2 f.

Not modelled: a window of less than 6 bits that meets no frame; one that begins within an error frame or intermission
counts as on an idle bus; overload flags; the sender of one frame that is bus-off and still counted.
"""

from __future__ import annotations

from typing import NamedTuple

from netem.media.can.bit_clock import BitClock
from netem.media.can.bit_sequence import bit_sequence
from netem.media.can.encoded_frame import EncodedFrame


class Window(NamedTuple):
    start_ns: int
    end_ns: int


class StuckDominant:
    """The windows of all faults, told before they begin."""

    def __init__(self, clock: BitClock) -> None:
        self._clock = clock
        self.windows: list[Window] = []

    def first_hit(self, encoded: EncodedFrame, start_ns: int) -> int | None:
        """Return the first recessive bit, SOF = 0, of a frame that begins within a window; None if there is none."""
        end_ns = start_ns + self._clock.ns(encoded.nominal_bits * self._clock.nominal
                                           + encoded.data_bits * self._clock.data)
        hits = [self._hit(encoded, start_ns, window) for window in self.windows
                if window.start_ns < end_ns and window.end_ns > start_ns]
        return min([hit for hit in hits if hit is not None], default=None)

    def _hit(self, encoded: EncodedFrame, start_ns: int, window: Window) -> int | None:
        sequence, clock = bit_sequence(encoded.data), self._clock
        for bit, level in enumerate(sequence.bits):
            nominal, data = sequence.rates_up_to(bit - 1) if bit else (0, 0)
            begins_ns = start_ns + clock.ns(nominal * clock.nominal + data * clock.data)
            if level == "1" and window.start_ns <= begins_ns < window.end_ns:
                return bit
        return None

"""Capture: a receiver decodes a frame that exceeds the sum of all frames overlapping it by `capture_db`.

    rx(wanted) - 10 log10(sum of 10^(rx(rival)/10)) >= capture_db     at every instant of the wanted frame   [dBm, dB]

The sum is over the rivals on the air at one instant, including those too weak to be decoded; rivals one after another
do not add up. A receiver that transmits during any part of a frame is deaf to it. As capture_db > 0, a receiver decodes
at most one of several overlapping frames.

Not modelled: the preamble to which a receiver locks (a later, stronger frame is decoded too), bit errors that do not
lose the frame, noise other than through the sensitivity.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log10

from netem.core.fate import Fate
from netem.media.decoding.on_air import OnAir


@dataclass(frozen=True)
class Capture:
    capture_db: float
    overlaps_matter = True
    overlap_loses_both = False

    def fate(self, wanted: OnAir, receiver: str) -> Fate | None:
        felt: list[OnAir] = []
        for rival in wanted.rivals:
            if rival.sender == receiver:
                return Fate.DEAF
            if receiver in rival.reach.rx_dbm:
                felt.append(rival)
        limit_dbm = wanted.reach.rx_dbm[receiver] - self.capture_db
        for latest in felt:             # interference is greatest at the start of the wanted frame or of a rival
            instant_ns = max(latest.start_ns, wanted.start_ns)
            together_dbm = [rival.reach.rx_dbm[receiver] for rival in felt
                            if rival.start_ns <= instant_ns < rival.end_ns]
            if sum_dbm(together_dbm) > limit_dbm:
                return Fate.COLLIDED
        return None


def sum_dbm(powers_dbm: list[float]) -> float:
    """Power of the sum of several signals; exact for one signal."""
    strongest_dbm = max(powers_dbm)
    if len(powers_dbm) == 1:
        return strongest_dbm
    return float(strongest_dbm + 10 * log10(sum(10 ** ((power - strongest_dbm) / 10) for power in powers_dbm)))

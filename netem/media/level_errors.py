"""Bit errors that depend on the received power: a frame near the edge of the range is often, but not always, lost.

    Eb/N0 [dB] = rx_dbm - noise_dbm + 10 log10(bandwidth_hz / bit_rate_bps)         p = bit error probability of it
    a frame of n bits at the bit rate, header and checksum included, is whole with probability (1 - p)^n

A frame that a receiver decodes, because it is in range and nothing disturbs it, may still have bit errors; its checksum
finds them. Each link draws from its own stream, once for each such copy.

Not modelled: interference as noise (the decode rule decides about it), errors in the preamble, a checksum that fails.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, log10
from random import Random

from netem.media.modulations import MODULATIONS, Modulation


@dataclass(frozen=True)
class LevelErrorSettings:
    modulation: Modulation
    noise_dbm: float                    # noise power in the receiver's bandwidth, its noise figure included
    bandwidth_hz: float | None = None   # of the receiver; None: as many Hz as the bit rate has bit/s

    def __post_init__(self) -> None:
        if not isfinite(self.noise_dbm):
            raise ValueError(f"noise_dbm={self.noise_dbm}: expected a finite number")
        if self.bandwidth_hz is not None and not self.bandwidth_hz > 0:
            raise ValueError(f"bandwidth_hz={self.bandwidth_hz}: expected > 0")


class LevelErrors:
    """Decides which copies have bit errors; `rng_for` returns the stream of a link, "sender -> receiver"."""

    def __init__(self, settings: LevelErrorSettings, bit_rate_bps: int, header_bits: int,
                 rng_for: Callable[[str], Random]) -> None:
        self._bit_error_probability = MODULATIONS[settings.modulation]
        self._noise_dbm = settings.noise_dbm - 10 * log10((settings.bandwidth_hz or bit_rate_bps) / bit_rate_bps)
        self._header_bits = header_bits
        self._rng_for = rng_for
        self._rngs: dict[tuple[str, str], Random] = {}

    def whole_probability(self, rx_dbm: float, payload_bytes: int) -> float:
        """Return the probability that a frame received with `rx_dbm` has no bit error."""
        p = self._bit_error_probability(10 ** ((rx_dbm - self._noise_dbm) / 10))
        return float((1 - p) ** (self._header_bits + 8 * payload_bytes))

    def hit(self, sender: str, receiver: str, rx_dbm: float, payload_bytes: int) -> bool:
        """Draw whether the copy of a frame has bit errors."""
        link = sender, receiver
        rng = self._rngs.get(link)
        if rng is None:
            rng = self._rngs[link] = self._rng_for(f"{sender} -> {receiver}")
        return rng.random() >= self.whole_probability(rx_dbm, payload_bytes)

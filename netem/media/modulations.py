"""Bit error probabilities in white Gaussian noise, as functions of g = Eb/N0, the signal-to-noise ratio per bit.

    bpsk              Q(sqrt(2 g))           coherent; also QPSK with Gray coding      Proakis, Digital Communications,
    dbpsk             exp(-g) / 2            differential, not coherent                4th ed., 5.2
    fsk               Q(sqrt(g))             binary, orthogonal, coherent
    fsk_noncoherent   exp(-g / 2) / 2        binary, orthogonal, not coherent
    oqpsk_dsss        8/15 1/16 sum over k = 2..16 of (-1)^k binom(16, k) exp(2.5 g (1/k - 1))
                      O-QPSK of IEEE 802.15.4 at 250 kbit/s in 2 MHz (IEEE 802.15.4-2006, E.4.1.8: 20 SINR = 2.5 g)

Q(x) = erfc(x / sqrt 2) / 2. Not modelled: coding, fading within a frame, filters (GFSK is worse than FSK by some dB).
"""

from __future__ import annotations

from collections.abc import Callable
from math import comb, erfc, exp, sqrt
from typing import Final, Literal

Modulation = Literal["bpsk", "dbpsk", "fsk", "fsk_noncoherent", "oqpsk_dsss"]


def oqpsk_dsss(g: float) -> float:
    terms = ((-1.0 if k % 2 else 1.0) * comb(16, k) * exp(2.5 * g * (1 / k - 1)) for k in range(2, 17))
    return max(0.0, 8 / 15 / 16 * sum(terms))


MODULATIONS: Final[dict[str, Callable[[float], float]]] = {
    "bpsk": lambda g: 0.5 * erfc(sqrt(g)),
    "dbpsk": lambda g: 0.5 * exp(-g),
    "fsk": lambda g: 0.5 * erfc(sqrt(g / 2)),
    "fsk_noncoherent": lambda g: 0.5 * exp(-g / 2),
    "oqpsk_dsss": oqpsk_dsss,
}

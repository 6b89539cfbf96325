"""Named random streams: one generator for each (seed, place), so that adding a link never changes another's draws.

A stream is a `random.Random` seeded with the BLAKE2b digest of "seed/place" as an integer. The project draws with
`random()` only (Mersenne Twister, 53 bits, about 30 ns a call): Python guarantees the same sequence in every version
for seeding and `random()`, not for `gauss`, `randrange` or `shuffle`. Other distributions are drawn by applying their
quantile function to `random()`.

Not modelled: cryptographic quality; jumping ahead.
"""

from __future__ import annotations

from hashlib import blake2b
from random import Random


def stream(seed: int, place: str) -> Random:
    """Return a new generator for a place such as `impairments[0]/radio: a -> b`; equal arguments give equal draws."""
    return Random(int.from_bytes(blake2b(f"{seed}/{place}".encode(), digest_size=32).digest(), "big"))

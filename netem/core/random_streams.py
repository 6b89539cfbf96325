"""Named random streams: one generator per (seed, place), so that adding a link never changes another's draw.

A stream is a `random.Random` seeded with the BLAKE2b digest of "seed/place", as an integer. Every draw of the project
is made from `random()`: of `random.Random` only the seeding and `random()` (Mersenne Twister, 53 bits, in C, some 30 ns
a call) are promised to give the same sequence in every version of Python. `gauss`, `randrange`, `shuffle` and the like
are not, so other distributions come from `random()` through their quantile function.

Not modelled: cryptographic quality; jumping ahead.
"""

from __future__ import annotations

from hashlib import blake2b
from random import Random


def stream(seed: int, place: str) -> Random:
    """The generator of a place such as `impairments[0]/radio: a -> b`; the same pair always gives the same draws."""
    return Random(int.from_bytes(blake2b(f"{seed}/{place}".encode(), digest_size=32).digest(), "big"))

"""Time in nanoseconds: the instant that means never, and the units in which files give times."""

from __future__ import annotations

from typing import Final

NEVER_NS: Final = 1 << 62       # later than every instant of a run
NS_PER: Final = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1}


def in_ms(time_ns: int) -> str:
    """Return a duration as text in milliseconds, exact to the nanosecond up to 1000 s: "16.357753 ms"."""
    return f"{time_ns / 1e6:.12g} ms"

"""Timestamps of a program: its node's local clock, each later than the one before (Kulkarni et al. 2014).

The fraction of a second is written as floor(ns 2^32 / 10^9), from which the nanoseconds come back exactly.
Not modelled: the clock does not follow the timestamps that it receives, as that of Zenoh's routers does.
"""

from __future__ import annotations

from collections.abc import Callable

from netem.wire.zenoh_messages import Stamp


class HybridClock:
    def __init__(self, now_ns: Callable[[], int], identifier: bytes) -> None:
        """`now_ns` returns the local clock [ns], 0 is 1 January 1970; a time before that counts as 0."""
        self._now_ns = now_ns
        self._identifier = identifier
        self._last_ns = -1

    def stamp(self) -> Stamp:
        self._last_ns = max(self._last_ns + 1, self._now_ns(), 0)
        seconds, nanoseconds = divmod(self._last_ns, 10**9)
        return Stamp(seconds << 32 | (nanoseconds << 32) // 10**9, self._identifier)

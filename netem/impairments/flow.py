"""The most traffic that a sender puts on a link, as a bound on the delays needs it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Flow:
    """Within any `every_ns` at most one frame of each of `sizes_bytes`, and each frame in up to `copies` copies."""

    sizes_bytes: tuple[int, ...]
    every_ns: int                       # > 0
    copies: int = 1

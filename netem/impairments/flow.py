"""The frames that a sender puts on a link at most: the load for which an impairment bounds its delay."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Flow:
    """Within any `every_ns` at most one frame of each of `sizes_bytes`, and each frame in up to `copies` copies."""

    sizes_bytes: tuple[int, ...]
    every_ns: int                       # > 0
    copies: int = 1

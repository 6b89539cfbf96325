"""The most frames that a sender puts on a link: the load for which an impairment bounds its delay."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Flow:
    """A flow of at most one frame of each of `sizes_bytes` within any `every_ns`, each in up to `copies` copies."""

    sizes_bytes: tuple[int, ...]
    every_ns: int                       # > 0
    copies: int = 1

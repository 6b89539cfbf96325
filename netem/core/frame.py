"""What a node handed out: bytes with a number, of which each intended receiver gets a copy of its own.

A frame has one number per (medium, sender), counted from 0 in the order in which it was handed out.
"""

from __future__ import annotations

from hashlib import blake2b


class Frame:
    """Bytes that one node handed out on one medium."""

    __slots__ = ("data", "digest", "end_ns", "medium", "number", "offered_ns", "on_air_ns", "sender")

    def __init__(self, medium: str, sender: str, number: int, offered_ns: int, data: bytes, on_air_ns: int = -1,
                 end_ns: int = -1) -> None:
        self.medium = medium
        self.sender = sender
        self.number = number
        self.offered_ns = offered_ns
        self.data = data
        self.digest: bytes = blake2b(data, digest_size=8).digest()
        self.on_air_ns = on_air_ns      # start on the air, -1 before
        self.end_ns = end_ns            # first instant after the last bit

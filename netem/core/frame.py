"""A frame: bytes that one node offered to a medium, and of which each intended receiver gets its own copy.

Frames are numbered from 0 for each (medium, sender), in the order in which the node made its offers.
"""

from __future__ import annotations

from hashlib import blake2b


class Frame:
    """One offer of a node, from then on followed by its medium. `digest` is the 8-byte BLAKE2b hash of `data`.

    A medium that may let the frame wait keeps its intended receivers at the offer in `offered_to`.
    """

    __slots__ = ("data", "digest", "end_ns", "medium", "number", "offered_ns", "offered_to", "on_air_ns", "sender")

    def __init__(self, medium: str, sender: str, number: int, offered_ns: int, data: bytes, on_air_ns: int = -1,
                 end_ns: int = -1) -> None:
        self.medium = medium
        self.sender = sender
        self.number = number
        self.offered_ns = offered_ns
        self.data = data
        self.digest: bytes = blake2b(data, digest_size=8).digest()
        self.offered_to: tuple[str, ...] = ()
        self.on_air_ns = on_air_ns      # instant at which its first bit is sent, -1 until then
        self.end_ns = end_ns            # first instant after its last bit, -1 until that is known

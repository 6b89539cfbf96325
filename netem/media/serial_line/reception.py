"""What the receiver of one direction has on the way to it on a line that delivers when it falls idle.

The bytes are those that the transmitter has taken and that no delivery has yet. They may come from several writes, with
silences between them that are shorter than the idle time.
"""

from __future__ import annotations


class Reception:
    def __init__(self) -> None:
        self.data = b""
        self.offered_ns = 0         # instant of the write that the first byte is from
        self.begin_ns = 0           # of the first byte on the line
        self.end_ns = 0             # of the last byte on the line

    def add(self, data: bytes, offered_ns: int, begin_ns: int, end_ns: int) -> None:
        """Note bytes of one write that are on the line from `begin_ns` to `end_ns`."""
        if not self.data:
            self.offered_ns, self.begin_ns = offered_ns, begin_ns
        self.data += data
        self.end_ns = end_ns

"""The frame of topology discovery, little endian:

    magic u8 | version u8 | sender u8 | nodes u8 | epoch u16 | start cycle u32 | per node: bitmap of those it hears

A bitmap has ceil(nodes / 8) bytes. Bit j of node i's bitmap is set if i hears j; all zero: i's record is unknown.
At most 16 nodes fit into the 60 bytes of a Crazyflie-like radio payload.

Decoding never raises: it returns None for bytes that are no frame. Not modelled: a checksum; the radio has one.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import lru_cache

MAGIC = 0xD7
VERSION = 1
MAX_BYTES = 60
HEADER = struct.Struct("<BBBBHI")


@dataclass(frozen=True)
class DiscoveryFrame:
    sender: int
    epoch: int                      # 0 to 65535, compared modulo 65536
    start_cycle: int
    records: tuple[int, ...]        # bit j of records[i]: i hears j

    def encode(self) -> bytes:
        nodes = len(self.records)
        width = bitmap_bytes(nodes)
        header = HEADER.pack(MAGIC, VERSION, self.sender, nodes, self.epoch, self.start_cycle)
        return header + b"".join(record.to_bytes(width, "little") for record in self.records)


def bitmap_bytes(nodes: int) -> int:
    return (nodes + 7) // 8


def frame_bytes(nodes: int) -> int:
    """Return the length of a discovery frame among `nodes` nodes."""
    return HEADER.size + nodes * bitmap_bytes(nodes)


MAX_NODES = max(nodes for nodes in range(256) if frame_bytes(nodes) <= MAX_BYTES)


@lru_cache(maxsize=256)         # a flooding repeats the same frames
def decode(data: bytes, nodes: int) -> DiscoveryFrame | None:
    """Return the frame in `data`; None unless it is a consistent frame among exactly `nodes` nodes."""
    if len(data) != frame_bytes(nodes):
        return None
    magic, version, sender, claimed_nodes, epoch, start_cycle = HEADER.unpack_from(data)
    if (magic, version, claimed_nodes) != (MAGIC, VERSION, nodes) or sender >= nodes:
        return None
    width = bitmap_bytes(nodes)
    records = tuple(int.from_bytes(data[at:at + width], "little")
                    for at in range(HEADER.size, len(data), width))
    if any(record >> nodes or record >> i & 1 for i, record in enumerate(records)):
        return None                 # a node that does not exist, or one that hears itself
    return DiscoveryFrame(sender, epoch, start_cycle, records)

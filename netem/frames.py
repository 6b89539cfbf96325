"""What travels: a frame as handed out, its copy on one directed link, and how that copy ended.

Invariants:
- a frame has one number per (medium, sender), counted from 0 in the order in which it was handed out;
- every copy of a frame towards every intended receiver ends in exactly one `Fate`.
"""

from __future__ import annotations

from enum import Enum
from hashlib import blake2b

import msgspec


class Fate(Enum):
    """How one frame copy ended at one intended receiver."""

    DELIVERED = "delivered"
    DELIVERED_CORRUPT = "delivered corrupt"     # bits flipped on a link without a checksum
    COLLIDED = "collided"                       # overlapped at the receiver
    DEAF = "deaf"                               # the receiver itself was transmitting
    TOO_WEAK = "too weak"                       # below the receiver's sensitivity
    OUT_OF_VIEW = "out of view"                 # not where the observer's camera looks
    OCCLUDED = "occluded"                       # behind an obstacle
    LOST = "lost"                               # dropped by an impairment
    CORRUPTED = "corrupted"                     # bits flipped, found by the link's checksum
    QUEUE_FULL = "queue full"                   # a rate limit's queue overflowed
    BUS_OFF = "bus off"                         # the sender's or the receiver's CAN controller took no part
    SENDER_BUSY = "sender busy"                 # handed out while the sender was still transmitting
    CHANNEL_BUSY = "channel busy"               # carrier sense gave up
    MALFORMED = "malformed"                     # not what the medium carries, or longer
    UNFINISHED = "unfinished"                   # the run ended first
    RECEIVER_GONE = "receiver gone"             # the receiver's node had ended


class Frame(msgspec.Struct, gc=False):
    """Bytes that one node handed out on one medium."""

    medium: str
    sender: str
    number: int
    offered_ns: int
    data: bytes
    digest: bytes = b""
    on_air_ns: int = -1         # start on the air, -1 before
    end_ns: int = -1            # first instant after the last bit

    def __post_init__(self) -> None:
        self.digest = blake2b(self.data, digest_size=8).digest()


class Transit(msgspec.Struct, gc=False):
    """One copy of a frame on one directed link; impairments yield changed ones with `msgspec.structs.replace`.

    `number` counts the copies that entered this link, from 0; duplicates keep the number of their original.
    `sent_ns` is the instant at which the copy entered the link, `arrival_ns` (>= sent_ns) when it comes out.
    """

    number: int
    sent_ns: int
    arrival_ns: int
    data: bytes
    corrupt: bool = False
    copy: int = 0               # 0 the original, 1.. duplicates

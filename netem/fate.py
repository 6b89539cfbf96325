"""How one frame copy ended. Every copy towards every intended receiver ends in exactly one `Fate`."""

from __future__ import annotations

from enum import Enum


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

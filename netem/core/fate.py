"""The fates of frame copies: each copy for each intended receiver ends in exactly one.

    fate.value      its name in records and `[expect]`
    fate.meaning    one sentence for a reader of the report and of docs/records.md
    fate.arrived    whether the receiver's program got the bytes, flipped ones included
    fate.unseen     whether it is the answer to a look: nothing was there to be seen
"""

from __future__ import annotations

from enum import Enum


class Fate(Enum):
    """The end of one frame copy at one intended receiver."""

    meaning: str

    def __new__(cls, name: str, meaning: str = "") -> Fate:
        fate = object.__new__(cls)
        fate._value_ = name
        fate.meaning = meaning
        return fate

    @property
    def arrived(self) -> bool:
        return self in (Fate.DELIVERED, Fate.DELIVERED_CORRUPT)

    @property
    def unseen(self) -> bool:
        return self in (Fate.OUT_OF_VIEW, Fate.OCCLUDED)

    DELIVERED = (
        "delivered", "The copy reached the receiver's program as it was sent.")
    DELIVERED_CORRUPT = (
        "delivered corrupt", "Bits were flipped on a link without a checksum, and the copy reached the program so.")
    COLLIDED = (
        "collided", "Another frame overlapped it at the receiver, too strong to decode either.")
    DEAF = (
        "deaf", "The receiver was transmitting itself while the frame was on the air.")
    TOO_WEAK = (
        "too weak", "The frame arrived below the receiver's sensitivity: the receiver is out of range.")
    OUT_OF_VIEW = (
        "out of view", "The observer's camera did not look there at the exposure.")
    OCCLUDED = (
        "occluded", "An obstacle stood between the camera and the body at the exposure.")
    LOST = (
        "lost", "An impairment dropped the copy; its cause names which.")
    CORRUPTED = (
        "corrupted", "Bits were flipped, the link's checksum found it, and the receiver discarded the copy.")
    QUEUE_FULL = (
        "queue full", "A queue on the way, the sender's or that of a rate limit, was full when the frame came to it.")
    BUS_OFF = (
        "bus off", "The CAN controller of the sender or of the receiver was off the bus after too many errors.")
    ARBITRATION_LOST = (
        "arbitration lost", "The CAN frame lost arbitration, and its sender had asked for one attempt only.")
    SENDER_BUSY = (
        "sender busy", "The sender handed the frame out while it was still transmitting the one before.")
    CHANNEL_BUSY = (
        "channel busy", "Carrier sense found the channel busy at every attempt and gave up.")
    MALFORMED = (
        "malformed", "The frame is not what the medium carries, or it is longer than the medium allows.")
    UNFINISHED = (
        "unfinished", "The run ended while the copy was still on its way.")
    RECEIVER_GONE = (
        "receiver gone", "The receiver's node was dead when the copy arrived: a fault had killed it, which its cause "
        "names.")
    RECEIVER_PAUSED = (
        "receiver paused", "The receiver's node stood still by a fault, which its cause names, and its receive "
        "buffer was full.")
    CUT = (
        "cut", "A fault had cut the link when the copy entered it or would have arrived, or had stopped its carrier; "
        "its cause names which.")
    JAMMED = (
        "jammed", "A jammer was on the air at the receiver while the frame was; its cause names the fault.")
    BLACKED_OUT = (
        "blacked out", "A fault had blinded the sensor at the exposure; its cause names which.")

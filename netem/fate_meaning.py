"""The meaning of each fate of a frame copy, one sentence each, for a reader of the report and of docs/records.md."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from netem.fate import Fate

MEANING: Final[Mapping[Fate, str]] = MappingProxyType({
    Fate.DELIVERED: "The copy reached the receiver's program as it was sent.",
    Fate.DELIVERED_CORRUPT: "Bits were flipped on a link without a checksum, and the copy reached the program so.",
    Fate.COLLIDED: "Another frame overlapped it at the receiver, too strong to decode either.",
    Fate.DEAF: "The receiver was transmitting itself while the frame was on the air.",
    Fate.TOO_WEAK: "The frame arrived below the receiver's sensitivity: the receiver is out of range.",
    Fate.OUT_OF_VIEW: "The observer's camera did not look there at the exposure.",
    Fate.OCCLUDED: "An obstacle stood between the camera and the body at the exposure.",
    Fate.LOST: "An impairment dropped the copy; its cause names which.",
    Fate.CORRUPTED: "Bits were flipped, the link's checksum found it, and the receiver discarded the copy.",
    Fate.QUEUE_FULL: "A queue on the way, the sender's or that of a rate limit, was full when the frame came to it.",
    Fate.BUS_OFF: "The CAN controller of the sender or of the receiver was off the bus after too many errors.",
    Fate.SENDER_BUSY: "The sender handed the frame out while it was still transmitting the one before.",
    Fate.CHANNEL_BUSY: "Carrier sense found the channel busy at every attempt and gave up.",
    Fate.MALFORMED: "The frame is not what the medium carries, or it is longer than the medium allows.",
    Fate.UNFINISHED: "The run ended while the copy was still on its way.",
    Fate.RECEIVER_GONE: "The receiver's node had ended before the copy arrived.",
})

"""The frames by which Zenoh messages travel on a medium, for programs and gateways alike.

    frame    = receiver (2 bytes) | sender (2 bytes) | FRAME or FRAGMENT
    FRAME    = header (1) | sequence number (4) | [priority (2), if it is not DATA] | network messages
    FRAGMENT = header (1) | sequence number (4) | [priority (2)] | [first of its message (1)] | piece of a message

Counted are all bytes of Zenoh's transport, network and data messages, in the library's own format (1.x). The addresses
of receiver and sender, short as those of IEEE 802.15.4, stand for those in the headers of UDP and IP, which a medium
counts by itself where it has them. The 2 bytes of length that Zenoh writes on TCP are not there.

Differs from Zenoh: a key expression is always written in full, as a receiver on a broadcast medium may not have heard
the declaration that gives it a number; so a message is longer than on a connection on which its key was declared, by
that part of the key. Nothing is acknowledged or sent again, as in Zenoh's multicast transport.

Source: eclipse-zenoh/zenoh, commons/zenoh-protocol/src/transport/{frame,fragment}.rs (2024).
Not modelled: JOIN and KEEPALIVE (declarations are repeated instead), shared memory, compression, source information,
timestamp stacks; two sequences of numbers for reliable and other messages.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

from netem.wire.zenoh_codec import decode, encode
from netem.wire.zenoh_messages import USUAL, MalformedZenohFrame, Message, priority_of

EVERYONE: Final = 0xFFFF            # address of all nodes on the medium
ADDRESS_BYTES: Final = 4            # receiver and sender
LEAST_ROOM: Final = 20              # bytes; a medium has to carry frames of this length at least
LARGEST_BATCH: Final = 65_535       # bytes of a FRAME or FRAGMENT where the medium sets no limit
LARGEST_MESSAGE: Final = 2**30      # bytes of a message, Zenoh's default limit; one that grows beyond it is dropped
SN_MASK: Final = 2**28 - 1          # of a sequence number
SN_FIRST: Final = 2**21             # the least number that is 4 bytes long, as nearly all that Zenoh starts with
LATE: Final = 1024                  # a frame so many numbers behind the newest of its sender, or fewer, is late

_FRAME, _FRAGMENT, _ID = 0x05, 0x06, 0x1F
_RELIABLE, _MORE, _EXTENDED = 0x20, 0x40, 0x80
_PRIORITY, _FIRST = 0x31, 0x02      # extensions
_NUMBER_BYTES: Final = 5            # header and sequence number


class Batch(NamedTuple):
    """What a receiver has got with one frame; no messages while it waits for more fragments."""

    sender: int
    receiver: int
    messages: list[Message]


class ZenohSender:
    """Turns the messages of one node on one medium into frames of at most `longest_bytes` (None: no limit).

    `first_number`: sequence number of its first frame, at least `SN_FIRST`; drawn at random it differs from life to
    life of a node.
    """

    def __init__(self, address: int, longest_bytes: int | None, first_number: int = SN_FIRST) -> None:
        if not 0 <= address < EVERYONE:
            raise ValueError(f"address={address}: expected 0 <= address < {EVERYONE}")
        if longest_bytes is not None and longest_bytes < LEAST_ROOM:
            raise ValueError(f"longest_bytes={longest_bytes}: a Zenoh message needs frames of at least {LEAST_ROOM}")
        most = LARGEST_BATCH + ADDRESS_BYTES
        self.address = address
        self.longest_bytes = most if longest_bytes is None else min(most, longest_bytes)
        self._number = first_number & SN_MASK

    def frames(self, messages: Iterable[Message], to: int = EVERYONE) -> list[bytes]:
        """Return the frames of these messages, in their order; neighbours of one priority share a frame that has room.

        A message that does not fit into one frame is sent in fragments.
        """
        addresses = to.to_bytes(2, "little") + self.address.to_bytes(2, "little")
        frames: list[bytes] = []
        waiting, of_priority = b"", USUAL.priority
        for message in messages:
            data, priority = encode(message), priority_of(message)
            room = self.longest_bytes - ADDRESS_BYTES - _NUMBER_BYTES - len(_priority(priority))
            if waiting and (priority != of_priority or len(waiting) + len(data) > room):
                frames.append(addresses + self._frame(waiting, of_priority))
                waiting = b""
            of_priority = priority
            if len(data) > room:
                frames += [addresses + fragment for fragment in self._fragments(data, priority, room)]
            else:
                waiting += data
        if waiting:
            frames.append(addresses + self._frame(waiting, of_priority))
        return frames

    def _frame(self, data: bytes, priority: int) -> bytes:
        extension = _priority(priority)
        return self._head(_FRAME | (_EXTENDED if extension else 0)) + extension + data

    def _fragments(self, data: bytes, priority: int, room: int) -> Iterable[bytes]:
        extension = _priority(priority)
        at = 0
        while at < len(data):
            first = at == 0
            piece = data[at:at + room - first]
            at += len(piece)
            header = _FRAGMENT | (_MORE if at < len(data) else 0) | (_EXTENDED if extension or first else 0)
            extensions = bytes([extension[0] | (_EXTENDED if first else 0), extension[1]]) if extension else b""
            yield self._head(header) + extensions + (bytes([_FIRST]) if first else b"") + piece

    def _head(self, header: int) -> bytes:
        number = self._number
        self._number = (number + 1) & SN_MASK
        out = bytearray([header | _RELIABLE])
        while number > 0x7F:
            out.append(number & 0x7F | 0x80)
            number >>= 7
        out.append(number)
        return bytes(out)


@dataclass(slots=True)
class _Heard:
    """What a receiver keeps of one sender."""

    newest: int                     # sequence number
    partial: bytearray | None = None    # fragments of the message that is under way


class ZenohReceiver:
    """Turns the frames that one node receives on one medium into messages.

    A frame that is late or repeated by its number is dropped, as Zenoh does; of a message in fragments, each has to
    arrive in order.
    """

    def __init__(self) -> None:
        self.late = 0               # frames dropped, as a newer one of their sender had arrived
        self.incomplete = 0         # messages dropped, as a fragment did not arrive
        self._senders: dict[int, _Heard] = {}

    def take(self, frame: bytes) -> Batch:
        """Return what has arrived with `frame`; raises MalformedZenohFrame for bytes that are no such frame."""
        if len(frame) < ADDRESS_BYTES + 2:
            raise MalformedZenohFrame(f"{len(frame)} bytes, expected at least {ADDRESS_BYTES + 2}")
        receiver, sender = int.from_bytes(frame[:2], "little"), int.from_bytes(frame[2:4], "little")
        header, number, first, at = _read_head(frame)
        heard = self._senders.get(sender)
        if heard is None:
            heard = self._senders[sender] = _Heard((number - 1) & SN_MASK)
        ahead = (number - heard.newest) & SN_MASK
        if not ahead or SN_MASK + 1 - ahead < LATE:
            self.late += 1
            return Batch(sender, receiver, [])
        heard.newest = number
        if header & _ID == _FRAME:
            self._drop(heard)
            return Batch(sender, receiver, decode(frame[at:]))
        if first:
            self._drop(heard)
            heard.partial = bytearray()
        elif heard.partial is None or ahead != 1:
            self._drop(heard)
            return Batch(sender, receiver, [])
        partial = heard.partial
        assert partial is not None
        partial += frame[at:]
        if len(partial) > LARGEST_MESSAGE:
            self._drop(heard)
        elif not header & _MORE:
            heard.partial = None
            return Batch(sender, receiver, decode(bytes(partial)))
        return Batch(sender, receiver, [])

    def _drop(self, heard: _Heard) -> None:
        if heard.partial is not None:
            self.incomplete += 1
            heard.partial = None


def _priority(priority: int) -> bytes:
    return b"" if priority == USUAL.priority else bytes([_PRIORITY, priority])


def _read_head(frame: bytes) -> tuple[int, int, bool, int]:
    """Return header, sequence number, whether it is a first fragment, and where the payload begins."""
    header, number, at = frame[ADDRESS_BYTES], 0, ADDRESS_BYTES + 1
    if header & _ID not in (_FRAME, _FRAGMENT):
        raise MalformedZenohFrame(f"transport message {header & _ID:#x}")
    for shift in range(0, 35, 7):
        if at >= len(frame):
            raise MalformedZenohFrame("it ends within its sequence number")
        byte = frame[at]
        at += 1
        number |= (byte & 0x7F) << shift
        if byte < 0x80:
            break
    if number > SN_MASK or frame[at - 1] >= 0x80:
        raise MalformedZenohFrame(f"sequence number {number}, expected at most {SN_MASK}")
    first, more = False, bool(header & _EXTENDED)
    while more:
        if at >= len(frame):
            raise MalformedZenohFrame("it ends within its extensions")
        extension = frame[at]
        more = bool(extension & _EXTENDED)
        match extension & ~_EXTENDED:
            case 0x31:
                at += 2
            case 0x02:
                first, at = True, at + 1
            case _:
                raise MalformedZenohFrame(f"extension {extension & 0x0F} of a frame")
    return header, number, first, at

"""A datagram and the bytes of the frame that carries it, the same layout from program to medium and back.

    byte 0      length of the source's name, in bytes; 0 from a program: the medium fills in the sender
    byte 1      length of the destination's name, in bytes
    2 ...       name of the source, name of the destination, both in UTF-8, then the payload

    lan = board.port("lan", heard)
    lan.send(pack(Datagram("r2", b"payload")))          # to the node r2, to a group of the scenario, or to EVERYONE
    unpack(data)                                        # in `heard`: Datagram("r2", b"payload", source="r1")

On the links a packet has `header_bytes` (settings) in the place of the names, as addresses of a real network have one
length.
"""

from __future__ import annotations

from typing import Final, NamedTuple

EVERYONE: Final = "*"           # destination: all other nodes of the medium
MOST_NAME_BYTES: Final = 255


class Datagram(NamedTuple):
    destination: str            # a node, a group, or EVERYONE
    payload: bytes
    source: str = ""            # the node that sent it; "" before it is sent


def pack(datagram: Datagram) -> bytes:
    """Return the frame; raises ValueError for a name of more than 255 bytes in UTF-8."""
    source, destination = datagram.source.encode(), datagram.destination.encode()
    if max(len(source), len(destination)) > MOST_NAME_BYTES:
        raise ValueError(f"{datagram.destination[:40]!r}: a name has at most {MOST_NAME_BYTES} bytes in UTF-8")
    return bytes((len(source), len(destination))) + source + destination + datagram.payload


def unpack(data: bytes) -> Datagram | None:
    """Read a frame; None if it is too short for its header, or a name is not UTF-8."""
    if len(data) < 2 or len(data) < 2 + data[0] + data[1]:
        return None
    destination_at, payload_at = 2 + data[0], 2 + data[0] + data[1]
    try:
        return Datagram(data[destination_at:payload_at].decode(), data[payload_at:], data[2:destination_at].decode())
    except UnicodeDecodeError:
        return None

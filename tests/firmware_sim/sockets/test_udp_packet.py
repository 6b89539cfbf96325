"""The bytes of IPv4 and UDP, against a published header, a sum word by word, and flipped bits."""

from __future__ import annotations

import struct
from ipaddress import IPv4Address

from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.sockets.udp_packet import UdpPacket, pack_ip, pack_udp, unpack_ip, unpack_udp

ADDRESSES = st.integers(0, 2**32 - 1).map(IPv4Address)
PORTS = st.integers(1, 65535)
PACKETS = st.builds(UdpPacket, ADDRESSES, PORTS, ADDRESSES, PORTS, st.binary(max_size=40))


def word_by_word(data: bytes) -> int:
    """The sum of RFC 1071, section 4.1, in its own form."""
    total = 0
    for word, in struct.iter_unpack("!H", data + b"\0" * (len(data) % 2)):
        total += word
        total = (total & 0xFFFF) + (total >> 16)
    return total


@given(PACKETS, st.integers(0, 70_000))
def test_what_is_packed_is_read_again_and_28_bytes_longer_than_the_payload(packet, number):
    data = pack_ip(packet, number)

    assert unpack_ip(data) == packet
    assert len(data) == 28 + len(packet.payload)
    assert data[:2] == b"\x45\x00"
    assert data[8:10] == b"\x40\x11"


@given(PACKETS)
def test_both_checksums_make_the_sum_of_all_words_all_ones(packet):
    data = pack_ip(packet, 7)
    pseudo = packet.source.packed + packet.destination.packed + struct.pack("!HH", 17, len(data) - 20)

    assert word_by_word(data[:20]) == 0xFFFF
    assert word_by_word(pseudo + data[20:]) == 0xFFFF
    assert data[26:28] != b"\0\0"                       # which would mean: no checksum


def test_a_published_header_is_right_and_a_wrong_bit_in_it_is_not():
    header = bytes.fromhex("450000730000400040 11b861c0a80001c0a800c7")        # Wikipedia, Internet checksum
    datagram = struct.pack("!HHHH", 53, 53, 0x73 - 20, 0) + bytes(0x73 - 28)    # no checksum of UDP

    packet = unpack_ip(header + datagram)

    assert packet == UdpPacket(IPv4Address("192.168.0.1"), 53, IPv4Address("192.168.0.199"), 53, bytes(0x73 - 28))
    assert unpack_ip(header[:10] + b"\xb8\x60" + header[12:] + datagram) is None


@given(PACKETS.filter(lambda packet: packet.payload), st.data())
def test_no_single_flipped_bit_gets_through(packet, data):
    packed = pack_ip(packet, 3)
    bit = data.draw(st.integers(0, 8 * len(packed) - 1))
    flipped = (int.from_bytes(packed, "big") ^ 1 << bit).to_bytes(len(packed), "big")

    assert unpack_ip(flipped) is None


@given(st.binary(max_size=60))
def test_garbage_is_refused_and_never_raises(data):
    here = IPv4Address("10.0.0.1")

    found = unpack_udp(data, here, here)

    assert unpack_ip(data) is None or data[0] == 0x45
    assert found is None or pack_udp(found)[:6] == data[:6]

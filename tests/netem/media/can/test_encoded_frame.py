"""Lengths and rank of undisturbed frames: against bits written down one by one, published bounds, and each other."""

import random

import pytest
from hypothesis import example, given, settings

from netem.media.can.bit_sequence import Field, bit_sequence
from netem.media.can.crc import CRC_15, CRC_17, CRC_21, Crc
from netem.media.can.encoded_frame import encode_frame, most_classical_bits, most_fd_bits, rank_of
from netem.media.can.frame import FD_LENGTHS, CanFrame, pack
from tests.examples import examples
from tests.netem.media.can.bit_by_bit import Bit, encode
from tests.netem.media.can.frames import frames

NAMES = {Field.ARBITRATION: {"SOF", "ID", "SRR", "RRS", "RTR"}, Field.DATA: {"data"}, Field.CRC: {"CRC"},
         Field.CONTROL: {"IDE", "r1", "r0", "FDF", "res", "BRS", "ESI", "DLC"}, Field.CRC_DELIMITER: {"CRC delimiter"},
         Field.ACK_SLOT: {"ACK slot"}, Field.ACK_DELIMITER: {"ACK delimiter"}, Field.EOF: {"EOF"}}


@settings(max_examples=examples(400), deadline=None)
@given(frame=frames)
@example(CanFrame(0))                                                   # zeros from SOF to DLC
@example(CanFrame(0x7FF, b"\xff" * 8))
@example(CanFrame(0x123, b"\x00" * 64, fd=True, bit_rate_switch=True))
@example(CanFrame(0x555, b"\xaa\xff", fd=True))                         # ends in a run: the fixed stuff bit does
@example(CanFrame(0x7C0, fd=True, bit_rate_switch=True))                # a stuff bit just before BRS
def test_length_at_either_rate_is_that_of_the_bits_counted_one_by_one(frame: CanFrame) -> None:
    length = encode_frame(pack(frame))

    bits = encode(frame)
    assert (length.nominal_bits, length.data_bits) == (sum(not bit.fast for bit in bits), sum(bit.fast for bit in bits))


@settings(max_examples=examples(300), deadline=None)
@given(frame=frames)
def test_a_bit_sequence_is_the_same_bits_with_the_same_fields_and_rates(frame: CanFrame) -> None:
    sequence = bit_sequence(pack(frame))

    bits = encode(frame)
    assert sequence.bits == "".join(str(bit.level) for bit in bits)
    assert sequence.stuff == {place for place, bit in enumerate(bits) if bit.stuff}
    assert all(bit.fast == (sequence.fast_from <= place < sequence.fast_until) for place, bit in enumerate(bits))
    for place, bit in enumerate(bits):
        own = not (bit.name == "IDE" and frame.extended)        # part of the arbitration field there
        assert not own or bit.name in NAMES[sequence.fields[place]]


def arbitrate(one: list[Bit], other: list[Bit]) -> int:
    """Who is left on the bus, 0 or 1: dominant wins, bit by bit; -1 if nothing tells them apart."""
    for mine, theirs in zip(one, other, strict=False):
        if mine.level != theirs.level:
            return 0 if mine.level == 0 else 1
        if mine.name == "DLC":
            break
    return -1


@settings(max_examples=examples(300), deadline=None)
@given(one=frames, other=frames)
@example(CanFrame(0x123), CanFrame(0x123 << 18, extended=True))
@example(CanFrame(0x123, remote=True), CanFrame(0x123 << 18, extended=True))
@example(CanFrame(0x123, remote=True), CanFrame(0x123))
@example(CanFrame(0x123, remote=True), CanFrame(0x123, fd=True))
def test_the_lower_rank_wins_arbitration_bit_by_bit(one: CanFrame, other: CanFrame) -> None:
    ranks = rank_of(one), rank_of(other)

    winner = arbitrate(encode(one), encode(other))
    if ranks[0] != ranks[1]:
        assert winner == ranks.index(min(ranks))
    else:
        assert (one.can_id, one.extended, one.remote) == (other.can_id, other.extended, other.remote)


def test_standard_beats_extended_with_the_same_base_and_data_beats_remote() -> None:
    ranks = [rank_of(frame) for frame in (CanFrame(0x123), CanFrame(0x123, remote=True),
                                          CanFrame(0x123 << 18, extended=True),
                                          CanFrame(0x123 << 18, extended=True, remote=True), CanFrame(0x124))]

    assert ranks == sorted(ranks)
    assert len(set(ranks)) == 5


@pytest.mark.parametrize(("crc", "check"), [(CRC_15, 0x059E), (Crc(17, CRC_17.polynomial), 0x04F03),
                                            (Crc(21, CRC_21.polynomial), 0x0ED841)])
def test_checksums_of_the_catalogue(crc: Crc, check: int) -> None:
    """CRC RevEng catalogue: CRC-15/CAN, CRC-17/CAN-FD, CRC-21/CAN-FD over "123456789", with init 0."""
    assert crc.of(int.from_bytes(b"123456789", "big"), 72) == check


# Davis et al. 2007, eq. for C: with the intermission of 3 bits 55 + 10 s and 80 + 10 s for 11 and 29 bits.
@pytest.mark.parametrize("data_bytes", range(9))
def test_the_worst_stuffing_is_the_published_bound(data_bytes: int) -> None:
    assert most_classical_bits(data_bytes, extended=False) + 3 == 55 + 10 * data_bytes
    assert most_classical_bits(data_bytes, extended=True) + 3 == 80 + 10 * data_bytes


@settings(max_examples=examples(300), deadline=None)
@given(frame=frames)
def test_every_frame_lies_between_the_published_bounds(frame: CanFrame) -> None:
    length = encode_frame(pack(frame))
    bits = length.nominal_bits + length.data_bits

    if frame.fd:
        data_bytes = len(frame.data)
        nominal, data = most_fd_bits(data_bytes, extended=frame.extended)
        crc_field = 27 if data_bytes <= 16 else 32
        least = (41 if frame.extended else 22) + 8 * data_bytes + crc_field + 1 + 9
        assert least <= bits <= nominal + data
        assert not frame.bit_rate_switch or length.nominal_bits <= nominal
    else:
        data_bytes = len(frame.data)
        least = (54 if frame.extended else 34) + 8 * data_bytes + 10
        assert least <= bits <= most_classical_bits(data_bytes, extended=frame.extended)


def test_both_bounds_are_all_but_reached() -> None:
    """After a run of five, groups of four equal bits stuff at every fourth bit: the eight rotations of 0x0F. The CRC
    cannot be chosen, so the worst frame lacks at most the stuff bits of 15 bits, 4."""
    rng = random.Random("stuffing")
    rotations = [bytes([(0x0F0F >> turn) & 0xFF] * 8) for turn in range(8)]
    ordinary = [encode_frame(pack(CanFrame(can_id, rng.randbytes(8)))).nominal_bits for can_id in range(0x7FF)]
    stuffed = [encode_frame(pack(CanFrame(can_id, data))).nominal_bits for can_id in range(0x7FF) for data in rotations]

    assert min(ordinary) == 34 + 64 + 10
    assert max(stuffed) >= most_classical_bits(8, extended=False) - 4


def test_the_shortest_frame_of_all_has_44_bits_and_the_shortest_of_can_fd_26_and_33() -> None:
    """The lookahead rests on them: all standard identifiers, and a sample of lengths."""
    classical = [encode_frame(pack(frame)).nominal_bits for can_id in range(0x800)
                 for frame in (CanFrame(can_id), *(CanFrame(can_id, remote=True, dlc=dlc) for dlc in (0, 2, 5, 8)))]
    fd = [encode_frame(pack(CanFrame(can_id, fd=True, bit_rate_switch=True))) for can_id in range(0x800)]

    assert min(classical) == 44
    assert min((length.nominal_bits, length.data_bits) for length in fd) == (26, 33)
    assert min(length.nominal_bits + length.data_bits for length in fd) == 26 + 33


@pytest.mark.parametrize("data_bytes", FD_LENGTHS)
def test_a_frame_without_a_rate_switch_is_nominal_all_through(data_bytes: int) -> None:
    data = bytes(data_bytes)

    slow = encode_frame(pack(CanFrame(0x123, data, fd=True)))
    fast = encode_frame(pack(CanFrame(0x123, data, fd=True, bit_rate_switch=True)))

    assert slow.data_bits == 0
    assert abs(slow.nominal_bits - fast.nominal_bits - fast.data_bits) <= 1      # BRS itself may cost a stuff bit

"""Instants of bits: exact to the rounding of one, however many bits lie before."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.media.can.bit_clock import BitClock
from netem.media.can.encoded_frame import encode_frame
from netem.media.can.frame import CanFrame, pack
from tests.netem.media.can.can_bench import CanBench

SECOND = 10**9
RATES = [10_000, 33_333, 83_333, 125_000, 300_000, 500_000, 666_667, 1_000_000]


@given(rate=st.integers(1, 1_000_000), data=st.integers(1, 8_000_000), nominal_bits=st.integers(0, 10**9),
       data_bits=st.integers(0, 10**9))
def test_an_instant_is_the_exact_sum_rounded_once(rate: int, data: int, nominal_bits: int, data_bits: int) -> None:
    clock = BitClock(rate, data)

    exact = Fraction(nominal_bits * SECOND, rate) + Fraction(data_bits * SECOND, data)
    ns = clock.ns(nominal_bits * clock.nominal + data_bits * clock.data)
    assert abs(ns - exact) <= Fraction(1, 2)
    assert clock.whole_ns(nominal_bits, data_bits) <= exact <= clock.most_ns(nominal_bits, data_bits)


@pytest.mark.parametrize("rate", RATES)
def test_the_kth_of_frames_in_a_row_starts_at_the_exact_instant(rate: int) -> None:
    """2000 frames: roundings that add up would be off by some 1000 ns at 33 333 bit/s and by half a bit at 666 667."""
    frames = [CanFrame(0x100 + k % 7, k.to_bytes(8, "big")) for k in range(2000)]
    bench = CanBench("ab", bit_rate_bps=rate, queue="fifo", queue_frames=2000)

    bench.run(*((0, "a", frame) for frame in frames))

    bits = 0
    for row, frame in zip(bench.rows("a", "b"), frames, strict=True):
        assert abs(row["on_air_ns"] - Fraction(bits * SECOND, rate)) <= Fraction(1, 2)
        bits += encode_frame(pack(frame)).nominal_bits
        assert abs(row["end_ns"] - Fraction(bits * SECOND, rate)) <= Fraction(1, 2)
        bits += 3

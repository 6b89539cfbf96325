from netem.media.can.bit_clock import BitClock
from netem.media.can.bus_off_recovery import BusOffRecovery

BITS_11_NS = 36_667         # at 300 kbit/s 36 666.7 ns: between two rounded instants lie 36 666 or 36 667


def test_eleven_bits_between_rounded_instants_are_eleven_bits():
    recovery = BusOffRecovery(BitClock(300_000, None), since_ns=0, run_ns=0)

    recovery.interrupted(BITS_11_NS - 1, 2 * BITS_11_NS)
    recovery.interrupted(3 * BITS_11_NS, 4 * BITS_11_NS)

    assert recovery.occurrences == 2


def test_ten_bits_and_what_lies_before_counting_starts_are_none():
    recovery = BusOffRecovery(BitClock(300_000, None), since_ns=100 * BITS_11_NS, run_ns=0)

    recovery.interrupted(50 * BITS_11_NS, 101 * BITS_11_NS)
    recovery.interrupted(101 * BITS_11_NS + 33_333, 103 * BITS_11_NS)

    assert recovery.occurrences == 0

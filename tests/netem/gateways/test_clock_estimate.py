"""Synthetic device clocks with known offset, drift and delays: errors stay within the bounds that are derived."""

from __future__ import annotations

from math import isinf, isnan
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.gateways.clock_estimate import GROUP, KEPT, MOST_DRIFT_PPM, STEP_NS, ClockEstimate
from tests.examples import examples

S, MS, US = 1_000_000_000, 1_000_000, 1_000
UTC_NS = 1_800_000_000 * S


class Device:
    """A clock that shows `offset_ns + (1 + drift_ppm / 1e6) t`, rounded to ns."""

    def __init__(self, offset_ns: int, drift_ppm: float) -> None:
        self.offset_ns, self.drift_ppm = offset_ns, drift_ppm

    def shows(self, t_ns: int) -> int:
        return self.offset_ns + t_ns + round(self.drift_ppm * 1e-6 * t_ns)

    def offset_at(self, t_ns: int) -> float:
        return self.shows(t_ns) - t_ns


def exchanges(clock: ClockEstimate, device: Device, count: int, delays_ns, every_ns: int = S):
    for k in range(count):
        out_ns, back_ns = delays_ns(k)
        asked_ns = k * every_ns
        answered_ns = asked_ns + out_ns + back_ns
        yield answered_ns, clock.exchanged(asked_ns, device.shows(asked_ns + out_ns), answered_ns)


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(-UTC_NS, UTC_NS), st.floats(-200, 200), st.integers(0, 20 * MS), st.integers(0, 20 * MS),
       st.integers(1, 5 * MS), st.integers(1, 200))
def test_no_error_is_larger_than_its_bound_however_asymmetric_the_delays(
        offset_ns: int, drift_ppm: float, out_ns: int, back_ns: int, jitter_ns: int, count: int) -> None:
    draw, device, clock = Random(1), Device(offset_ns, drift_ppm), ClockEstimate()

    for now_ns, found in exchanges(clock, device, count, lambda k: (
            out_ns + draw.randrange(jitter_ns), back_ns + draw.randrange(jitter_ns))):
        # The offset changes by the drift between stamp and middle of an exchange, at most half of it, and clock and
        # middle are rounded to 1 ns each, as are the floats of the sums, which keep 52 bits of the offsets' span.
        most_ns = found.offset_bound_ns * (1 + abs(drift_ppm) * 1e-6) + 4
        assert abs(found.offset_ns - device.offset_at(now_ns)) <= most_ns + abs(UTC_NS) * 2**-52 * 2
        if not isnan(found.drift_ppm):
            assert abs(found.drift_ppm - drift_ppm) <= found.drift_bound_ppm * 1.001 + 0.01


def test_half_of_the_asymmetry_is_the_error_and_half_of_the_exchange_its_bound() -> None:
    device = Device(5 * S, 0.0)

    (now_ns, found), = exchanges(ClockEstimate(), device, 1, lambda k: (3 * MS, 1 * MS))

    assert found.offset_ns - device.offset_at(now_ns) == (3 * MS - 1 * MS) / 2
    since_ns = (3 * MS + 1 * MS) / 2            # from the middle of the exchange, to which its offset belongs
    assert found.offset_bound_ns == since_ns + since_ns * MOST_DRIFT_PPM * 1e-6
    assert isnan(found.drift_ppm)
    assert isinf(found.drift_bound_ppm)


def test_the_shortest_exchange_of_a_group_counts_so_queues_hardly_disturb() -> None:
    """Seven of eight exchanges wait up to 50 ms on the way out; the eighth is symmetric within 10 us."""
    draw, device, clock = Random(2), Device(-3 * S, 40.0), ClockEstimate()

    *_, (now_ns, found) = exchanges(clock, device, KEPT * GROUP, lambda k: (
        200 * US + (draw.randrange(10 * US) if k % GROUP == 3 else draw.randrange(1 * MS, 50 * MS)), 200 * US))

    # Each kept offset errs by at most 5 us, so the line at its end by at most four times that, and its slope by 5 us
    # times the sum of |t - mean| / sum of (t - mean)^2, which is 3 / T for n points over T.
    assert abs(found.offset_ns - device.offset_at(now_ns)) < 4 * 5 * US
    assert abs(found.drift_ppm - 40.0) < 3 * 5 * US / (KEPT * GROUP * S) * 1e6 * 1.1
    assert found.offset_bound_ns < 4 * 205 * US


def test_a_stamp_of_one_way_is_off_by_half_of_its_greatest_delay_at_most() -> None:
    device, clock = Device(UTC_NS, -25.0), ClockEstimate()
    for k in range(400):
        sent_ns = k * S // 10
        delay_ns = 300 * US + (k * 7919) % (400 * US)
        arrived_ns = sent_ns + delay_ns
        found = clock.stamped(device.shows(sent_ns), arrived_ns, most_delay_ns=700 * US)

    assert abs(found.offset_ns - device.offset_at(arrived_ns)) <= found.offset_bound_ns + UTC_NS * 2**-52 * 2
    assert abs(found.drift_ppm - -25.0) <= found.drift_bound_ppm


def test_a_clock_that_was_set_is_a_new_one() -> None:
    device, clock = Device(0, 10.0), ClockEstimate()
    list(exchanges(clock, device, 40, lambda k: (MS, MS)))
    device.offset_ns = 5 * STEP_NS

    found = clock.exchanged(100 * S, device.shows(100 * S + MS), 100 * S + 2 * MS)

    assert clock.steps == 1
    assert abs(found.offset_ns - device.offset_at(100 * S)) <= found.offset_bound_ns


def test_an_answer_before_its_question_is_refused() -> None:
    with pytest.raises(ValueError, match="answered_ns=1: expected an answer after the question at 2 ns"):
        ClockEstimate().exchanged(2, 0, 1)

"""The behaviour of every schedule: a new one adds a line to SCHEDULES."""

from collections.abc import Callable
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.schedules import Schedule
from firmware_sim.schedules.periodic import Periodic
from firmware_sim.schedules.slotted_broadcast import SlottedBroadcast

SLOTS = SlottedBroadcast(parts=3, slot_ns=1_100_000, start_ns=-7_000, guard_ns=50_000,
                         agents=5, control_offset_ns=600_000)


class Instants(NamedTuple):
    next_after: Callable[[int], int]


# the schedule, its period, its instant number k
SCHEDULES = {
    "periodic": (Periodic(10_000_000, 2_000_000), lambda k: 2_000_000 + k * 10_000_000),
    "periodic of 1 ns": (Periodic(1), lambda k: k),
    "slotted broadcast": (SLOTS, lambda k: 43_000 + k * 1_100_000),
    "part 2 of a slotted broadcast": (
        Instants(lambda now_ns: SLOTS.data_ns(SLOTS.next_slot_of(2, now_ns).number)),
        lambda k: 43_000 + (2 + 3 * k) * 1_100_000),
    "control of agent 4": (
        Instants(lambda now_ns: SLOTS.control_ns(SLOTS.next_control_of(4, now_ns).number)),
        lambda k: -7_000 + 600_000 + (4 + 5 * k) * 1_100_000),
}

every_schedule = pytest.mark.parametrize(("schedule", "instant"), SCHEDULES.values(), ids=SCHEDULES)
local_times = st.integers(-10**10, 10**16)


@every_schedule
@given(now_ns=local_times)
def test_the_next_instant_lies_after_now(schedule: Schedule, instant, now_ns):
    assert schedule.next_after(now_ns) > now_ns


@every_schedule
@given(now_ns=local_times)
def test_asking_at_an_instant_gives_the_next_one(schedule: Schedule, instant, now_ns):
    first_ns = schedule.next_after(now_ns)
    second_ns = schedule.next_after(first_ns)

    assert second_ns > first_ns
    assert all(schedule.next_after(t) == second_ns for t in (first_ns, (first_ns + second_ns) // 2, second_ns - 1))


@every_schedule
@given(k=st.integers(0, 10**9))
def test_instant_k_comes_from_k_and_not_from_a_sum(schedule: Schedule, instant, k):
    assert schedule.next_after(instant(k) - 1) == instant(k)
    assert schedule.next_after(instant(k)) == instant(k + 1)


@every_schedule
@given(times=st.lists(local_times, min_size=2, max_size=10))
def test_later_questions_never_get_earlier_answers(schedule: Schedule, instant, times):
    answers = [schedule.next_after(now_ns) for now_ns in sorted(times)]

    assert answers == sorted(answers)


@every_schedule
def test_before_the_start_the_first_instant_is_due(schedule: Schedule, instant):
    assert schedule.next_after(-10**15) == instant(0)


@pytest.mark.parametrize(("period_ns", "offset_ns"), [(0, 0), (-5, 0), (10, 10), (10, -1)])
def test_a_period_that_cannot_be_is_refused(period_ns, offset_ns):
    with pytest.raises(ValueError, match="expected"):
        Periodic(period_ns, offset_ns)

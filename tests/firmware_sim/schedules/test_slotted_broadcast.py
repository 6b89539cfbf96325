from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.schedules.slotted_broadcast import Slot, SlottedBroadcast, SlotTooShort

US = 1000


@st.composite
def slotted(draw: st.DrawFn) -> SlottedBroadcast:
    guard_ns = draw(st.integers(0, 500))
    control_ns = 2 * guard_ns + draw(st.integers(1, 1000))
    return SlottedBroadcast(draw(st.integers(1, 7)), control_ns + guard_ns + draw(st.integers(1, 1000)),
                            draw(st.integers(-10**6, 10**6)), guard_ns, draw(st.integers(1, 9)), control_ns)


def by_counting(instants, local_ns: int, suits) -> int:
    """The first slot whose instant lies after `local_ns` and that suits, found by looking at one after the other."""
    return next(k for k in range(10**6) if instants(k) > local_ns and suits(k))


@given(slotted(), st.integers(-10, 300), st.data())
def test_the_slot_of_every_local_time_holds_it(schedule, k, data):
    local_ns = schedule.start_ns + k * schedule.slot_ns + data.draw(st.integers(0, schedule.slot_ns - 1))

    slot = schedule.slot_at(local_ns)

    assert slot == Slot(k, k % schedule.parts, schedule.start_ns + k * schedule.slot_ns)


@given(slotted(), st.integers(-5000, 50_000), st.integers(-1, 60), st.data())
def test_the_next_slot_of_a_part_is_the_one_found_by_counting(schedule, since_start_ns, after_slot, data):
    local_ns = schedule.start_ns + since_start_ns
    part = data.draw(st.integers(0, schedule.parts - 1))

    slot = schedule.next_slot_of(part, local_ns, after_slot)

    assert slot.part == part
    assert slot.number == by_counting(schedule.data_ns, local_ns,
                                      lambda k: k > after_slot and k % schedule.parts == part)


@given(slotted(), st.integers(-5000, 50_000), st.integers(-1, 60), st.data())
def test_the_next_control_slot_of_an_agent_is_the_one_found_by_counting(schedule, since_start_ns, after_slot, data):
    local_ns = schedule.start_ns + since_start_ns
    agent = data.draw(st.integers(0, schedule.agents - 1))

    slot = schedule.next_control_of(agent, local_ns, after_slot)

    assert schedule.control_owner(slot.number) == agent
    assert slot.number == by_counting(schedule.control_ns, local_ns,
                                      lambda k: k > after_slot and k % schedule.agents == agent)


@given(slotted(), st.integers(0, 20), st.data())
def test_a_frame_is_attributed_to_its_slot_while_it_is_less_than_half_a_round_off(schedule, cycles, data):
    part = data.draw(st.integers(0, schedule.parts - 1))
    number = part + cycles * schedule.parts
    reach_ns = (schedule.round_ns - 1) // 2
    error_ns = data.draw(st.integers(-reach_ns, reach_ns))

    slot = schedule.nearest_slot_of(part, schedule.data_ns(number) + error_ns)

    assert slot.number == number


@given(slotted())
def test_every_agent_has_one_control_slot_per_cycle(schedule):
    slots = range(3 * schedule.agents)

    turns = [(schedule.control_cycle(k), schedule.control_owner(k)) for k in slots]

    assert turns == [(cycle, agent) for cycle in range(3) for agent in range(schedule.agents)]


def test_every_part_speaks_once_per_round_in_order():
    schedule = SlottedBroadcast(parts=3, slot_ns=10)

    assert [schedule.slot_at(local_ns).part for local_ns in range(0, 70, 10)] == [0, 1, 2, 0, 1, 2, 0]


def test_a_sender_whose_clock_was_set_back_does_not_speak_twice():
    schedule = SlottedBroadcast(parts=2, slot_ns=100 * US, guard_ns=10 * US)
    spoke = schedule.next_slot_of(0, -1)
    local_ns = schedule.data_ns(spoke.number) - 5 * US

    assert schedule.next_slot_of(0, local_ns).number == spoke.number
    assert schedule.next_slot_of(0, local_ns, after_slot=spoke.number).number == spoke.number + 2


def test_a_sender_whose_clock_was_set_forward_skips_what_it_missed():
    schedule = SlottedBroadcast(parts=2, slot_ns=100 * US)

    assert schedule.next_slot_of(1, local_ns=1_000_000 * US, after_slot=1).number == 10_001


@given(slotted(), st.integers(-5000, 50_000))
def test_a_new_schedule_begins_where_a_round_of_the_old_one_ends(schedule, since_start_ns):
    local_ns = schedule.start_ns + since_start_ns

    end_ns = schedule.round_end_after(local_ns)

    rounds, rest = divmod(end_ns - schedule.start_ns, schedule.parts * schedule.slot_ns)
    assert rest == 0
    assert rounds >= 0
    assert end_ns > local_ns
    assert rounds == 0 or end_ns - schedule.round_ns <= local_ns


def test_agents_that_change_over_in_different_slots_of_one_round_start_the_new_schedule_together():
    schedule = SlottedBroadcast(parts=3, slot_ns=100)

    assert {schedule.round_end_after(local_ns) for local_ns in (300, 417, 599)} == {600}


def test_a_round_that_ends_now_is_not_the_end_to_come():
    schedule = SlottedBroadcast(parts=2, slot_ns=50)

    assert [schedule.round_end_after(local_ns) for local_ns in (-1, 0, 99, 100)] == [0, 100, 100, 200]


def test_frames_fit_up_to_the_last_nanosecond():
    plain = SlottedBroadcast(parts=2, slot_ns=1000, guard_ns=100)
    with_control = SlottedBroadcast(parts=2, slot_ns=1000, guard_ns=100, agents=5, control_offset_ns=600)

    plain.fits(800)
    with_control.fits(400, 300)

    with pytest.raises(SlotTooShort, match=r"slot_ns=1000: a data frame of 801 ns .* 100 ns needs 1001 ns.* by 1 ns"):
        plain.fits(801)
    with pytest.raises(SlotTooShort, match=r"control_offset_ns=600: a data frame of 401 ns .* needs 601 ns"):
        with_control.fits(401, 300)
    with pytest.raises(SlotTooShort, match=r"slot_ns=1000: a control frame of 301 ns .* needs 1001 ns"):
        with_control.fits(400, 301)


def do_not_overlap(on_air: list[tuple[int, int]]) -> bool:
    return all(end_ns <= next_start_ns for (_, end_ns), (next_start_ns, _) in pairwise(on_air))


@given(slotted(), st.data())
def test_frames_that_fit_do_not_overlap_while_no_two_clocks_differ_by_more_than_the_guard(schedule, data):
    """Brute force over a few slots: each transmission is shifted by its owner's own clock error."""
    airtime_ns = schedule.control_offset_ns - 2 * schedule.guard_ns
    control_airtime_ns = schedule.slot_ns - schedule.control_offset_ns - schedule.guard_ns
    schedule.fits(airtime_ns, control_airtime_ns)
    error_ns = st.integers(0, schedule.guard_ns)
    part_errors = data.draw(st.lists(error_ns, min_size=schedule.parts, max_size=schedule.parts))
    agent_errors = data.draw(st.lists(error_ns, min_size=schedule.agents, max_size=schedule.agents))

    on_air = []
    for k in range(2 * schedule.parts * schedule.agents):
        start_ns = schedule.data_ns(k) + part_errors[k % schedule.parts]
        on_air.append((start_ns, start_ns + airtime_ns))
        start_ns = schedule.control_ns(k) + agent_errors[schedule.control_owner(k)]
        on_air.append((start_ns, start_ns + control_airtime_ns))

    assert do_not_overlap(on_air)


@pytest.mark.parametrize(("excess_ns", "clean"), [(0, True), (1, False)])
def test_without_control_sub_slots_clocks_may_differ_by_two_guards_and_no_more(excess_ns, clean):
    schedule = SlottedBroadcast(parts=2, slot_ns=1000, guard_ns=100)
    errors_ns = (100 + excess_ns, -100)

    on_air = [(start_ns, start_ns + 800) for start_ns in (schedule.data_ns(k) + errors_ns[k % 2] for k in range(6))]

    assert do_not_overlap(on_air) is clean


@pytest.mark.parametrize(("nonsense", "complaint"), [
    ({"parts": 0, "slot_ns": 10}, "parts=0"),
    ({"parts": 1, "slot_ns": 0}, "slot_ns=0"),
    ({"parts": 1, "slot_ns": 10, "guard_ns": -1}, "guard_ns=-1"),
    ({"parts": 1, "slot_ns": 10, "guard_ns": 5}, "slot_ns=10: expected more than two guard times"),
    ({"parts": 1, "slot_ns": 10, "agents": 3}, "control sub-slots need both"),
    ({"parts": 1, "slot_ns": 10, "control_offset_ns": 3}, "control sub-slots need both"),
    ({"parts": 1, "slot_ns": 10, "guard_ns": 2, "agents": 3, "control_offset_ns": 4}, "control_offset_ns=4"),
    ({"parts": 1, "slot_ns": 10, "guard_ns": 2, "agents": 3, "control_offset_ns": 8}, "control_offset_ns=8"),
])
def test_a_schedule_that_cannot_be_is_refused(nonsense, complaint):
    with pytest.raises(ValueError, match=complaint):
        SlottedBroadcast(**nonsense)


def test_a_part_or_an_agent_that_does_not_exist_is_refused_with_the_range():
    schedule = SlottedBroadcast(parts=3, slot_ns=100, agents=5, control_offset_ns=50)

    with pytest.raises(ValueError, match="part=3: expected 0 <= part < 3"):
        schedule.next_slot_of(3, 0)
    with pytest.raises(ValueError, match="agent=5: expected 0 <= agent < 5"):
        schedule.next_control_of(5, 0)
    with pytest.raises(ValueError, match="no control sub-slots"):
        SlottedBroadcast(parts=3, slot_ns=100).control_ns(0)

"""From the number of a slot back to the age of a value, also where numbers began anew meanwhile."""

from __future__ import annotations

import pytest

from agents.synchronization.age_watch import AgeWatch
from firmware_sim.schedules.slotted_broadcast import SlottedBroadcast

OLD = SlottedBroadcast(parts=3, slot_ns=1000, start_ns=0)
NEW = SlottedBroadcast(parts=2, slot_ns=700, start_ns=9000)
OLD_PARTS, NEW_PARTS = {0: 0, 1: 1, 2: 2}, {0: 0, 1: 0, 2: 1}


@pytest.fixture
def watch():
    """Its robot has gone over from OLD to NEW at 9000 ns."""
    watch = AgeWatch(oldest_ns=5000, tolerance_ns=20)
    watch.retire(OLD, OLD_PARTS, 0, 9000)
    return watch


@pytest.mark.parametrize(("sender", "slot", "now_ns", "age_ns"), [
    (0, 0, 9000, 0),
    (2, 1, 9750, 50),                       # slot 1 of NEW is part 1, robot 2's
    (0, 8, 14_600, 0),
    (0, 8, 14_590, -10),                    # a clock that is behind, within the tolerance
    (2, 8, 9100, 1100),                     # slot 8 of OLD began at 8000
    (1, 7, 9100, 2100),
    (1, 4, 9100, None),                     # 5100 ns are more than the links can cause
    (1, 2, 10_400, 0),                      # slot 2 of OLD is robot 2's, so this is NEW
    (1, 1, 9750, None),                     # of neither schedule within what the links can cause
    (0, 9, 9100, None),                     # OLD was over when its slot 9 would have begun
    (0, 40, 9100, None),
    (7, 0, 9100, None),
])
def test_the_latest_schedule_that_fits_gives_the_age(watch, sender, slot, now_ns, age_ns):
    assert watch.age_ns(sender, slot, now_ns, NEW, NEW_PARTS, 9000) == age_ns


def test_where_nobody_knows_how_late_values_can_be_every_age_counts():
    watch = AgeWatch(oldest_ns=-1, tolerance_ns=20)

    assert watch.age_ns(0, 0, 10**9, OLD, OLD_PARTS, 0) == 10**9


def test_schedules_from_before_the_robots_parted_count_no_more(watch):
    watch.forget()

    assert watch.age_ns(2, 8, 9100, NEW, NEW_PARTS, 9000) is None


def test_an_age_is_news_when_it_is_the_senders_first_or_twice_its_last_news():
    watch = AgeWatch(oldest_ns=-1, tolerance_ns=0)

    told = [watch.is_news(sender, age_ns) for sender, age_ns in [
        (1, 10), (1, 10), (1, 19), (2, 10), (1, 20), (1, 39), (1, 5), (1, 40)]]

    assert told == [True, False, False, True, True, False, False, True]

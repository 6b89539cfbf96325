"""Losses in a row, age, time between transmissions: by hand, and against the definition asked at every nanosecond."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import groupby, pairwise
from typing import NamedTuple

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from experiments.judge.frame_copies import FrameCopies
from experiments.judge.link_metrics import successive_losses
from experiments.judge.monitors.age_of_information import AgeOfInformation
from experiments.judge.monitors.inter_transmission_time import InterTransmissionTime
from experiments.judge.monitors.outcome import Finding
from experiments.judge.monitors.records import Records
from experiments.judge.monitors.successive_losses import SuccessiveLosses
from tests.examples import examples

AB, CB = ("radio", "a", "b"), ("radio", "c", "b")


class Copy(NamedTuple):
    number: int
    offered: int
    fate: str = "delivered"
    delivered: int = -1
    end: int = -1
    copy: int = 0
    link: tuple[str, str, str] = AB
    cause: str = ""


def records(copies: Iterable[Copy], length: int) -> Records:
    rows = [(medium, sender, c.number, receiver, c.copy, c.offered, c.offered if c.end >= 0 else -1, c.end, c.delivered,
             1, b"", c.fate, c.cause) for c in copies for medium, sender, receiver in [c.link]]
    return Records(length, FrameCopies.of_rows(rows))


def stretches(finding: Finding) -> list[tuple[str, int, int]]:
    return sorted((violation.on, violation.from_ns, violation.until_ns) for violation in finding.violations)


def runs(length: int, violated: Callable[[int], bool]) -> list[tuple[int, int]]:
    """The longest [from, until) over which `violated` is true at every nanosecond."""
    found, at = [], 0
    for state, group in groupby(range(length), violated):
        end = at + len(list(group))
        if state:
            found.append((at, end))
        at = end
    return found


# --- losses in a row, by hand

def test_a_row_breaks_the_bound_when_its_last_allowed_frame_plus_one_is_lost_and_until_one_gets_through() -> None:
    found = SuccessiveLosses(at_most=1).watch([AB], records([
        Copy(0, 0, delivered=12, end=10), Copy(1, 20, "lost", end=30, cause="impairments[0] x"),
        Copy(2, 40, "collided", end=50), Copy(3, 60, "lost", end=70, cause="impairments[0] x"),
        Copy(4, 80, delivered=92, end=90)], 200))

    assert stretches(found) == [("radio: a -> b", 50, 92)]
    violation, = found.violations
    assert (violation.node, violation.worst) == ("b", 3.0)
    assert violation.cause == "frame 1 lost (impairments[0] x), frame 2 collided"
    assert (found.worst, found.margin) == (3.0, -2.0)


def test_a_row_at_the_end_lasts_until_the_end_and_frames_under_way_end_nothing() -> None:
    found = SuccessiveLosses(at_most=0).watch([AB], records([
        Copy(0, 0, "deaf", end=10), Copy(1, 90, "unfinished", end=-1)], 100))

    assert stretches(found) == [("radio: a -> b", 10, 100)]
    assert found.worst == 1.0


def test_a_frame_that_never_got_on_the_air_is_lost_when_it_is_handed_out() -> None:
    found = SuccessiveLosses(at_most=0).watch([AB], records([Copy(0, 7, "sender busy"), Copy(1, 9, delivered=30)], 100))

    assert stretches(found) == [("radio: a -> b", 7, 30)]


def test_exactly_as_many_losses_as_allowed_are_no_violation_and_leave_no_margin() -> None:
    lost = [Copy(number, 10 * number, "lost", end=10 * number + 5) for number in range(3)]

    found = SuccessiveLosses(at_most=3).watch([AB], records(lost, 100))

    assert (found.violations, found.worst, found.margin) == ((), 3.0, 0.0)


def test_links_do_not_add_up_to_a_row() -> None:
    found = SuccessiveLosses(at_most=1).watch([AB, CB], records([
        Copy(0, 0, "lost", end=1), Copy(1, 2, delivered=4, end=3), Copy(0, 5, "lost", end=6, link=CB),
        Copy(1, 7, "lost", end=8, link=CB)], 100))

    assert stretches(found) == [("radio: c -> b", 8, 100)]


def test_a_frame_of_which_a_duplicate_arrives_is_not_lost() -> None:
    found = SuccessiveLosses(at_most=0).watch([AB], records([
        Copy(0, 0, "lost", end=1), Copy(0, 0, delivered=9, end=1, copy=1)], 20))

    assert found.violations == ()


# --- age of information, by hand

def test_the_bound_is_crossed_between_frames() -> None:
    found = AgeOfInformation(below_ns=50).watch([AB], records([
        Copy(0, 10, delivered=15, end=14), Copy(1, 40, "lost", end=44, cause="impairments[2] bernoulli_loss"),
        Copy(2, 58, delivered=75, end=70), Copy(3, 80, delivered=85, end=84)], 120))

    # handed out at 10, so 50 old at 60; frame 2 arrives at 75 and is 17 old then; at the end frame 3 is 40 old
    assert stretches(found) == [("radio: a -> b", 60, 75)]
    violation, = found.violations
    assert (violation.node, violation.worst) == ("b", pytest.approx(65e-9, rel=1e-12))
    assert violation.cause == ("no news since the frame handed out at 0.00000001 s: frame 1 lost "
                               "(impairments[2] bernoulli_loss), frame 2 on its way until 0.000000075 s")
    assert found.margin == pytest.approx(-15e-9, rel=1e-9)


def test_an_age_that_would_only_just_reach_the_bound_does_not() -> None:
    copies = [Copy(0, 0, delivered=5, end=4), Copy(1, 40, delivered=50, end=44)]

    assert AgeOfInformation(below_ns=50).watch([AB], records(copies, 90)).violations == ()      # 50 old at 50 and 90
    assert stretches(AgeOfInformation(below_ns=49).watch([AB], records(copies, 90))) == [
        ("radio: a -> b", 49, 50), ("radio: a -> b", 89, 90)]


def test_a_frame_that_is_too_old_when_it_arrives_does_not_end_the_violation() -> None:
    found = AgeOfInformation(below_ns=30).watch([AB], records([
        Copy(0, 5, delivered=50, end=6), Copy(1, 45, delivered=60, end=46)], 70))

    assert stretches(found) == [("radio: a -> b", 30, 60)]
    assert found.violations[0].cause == "no news since the start: frame 0 on its way until 0.00000005 s"


@pytest.mark.parametrize("copies", [[], [Copy(0, 50, "too weak", end=55)]])
def test_a_link_on_which_nothing_arrives_ages_from_the_start(copies: list[Copy]) -> None:
    found = AgeOfInformation(below_ns=40).watch([AB], records(copies, 100))

    assert stretches(found) == [("radio: a -> b", 40, 100)]
    assert found.violations[0].cause == "no news since the start: none was handed out"
    assert found.worst == pytest.approx(100e-9)


def test_corrupt_news_is_no_news() -> None:
    found = AgeOfInformation(below_ns=40).watch([AB], records([Copy(0, 30, "delivered corrupt", 35, 34)], 50))

    assert stretches(found) == [("radio: a -> b", 40, 50)]
    assert found.violations[0].cause == "no news since the start: frame 0 delivered corrupt"


# --- time between transmissions, by hand

def test_a_frame_too_early_violates_until_the_one_before_is_old_enough() -> None:
    found = InterTransmissionTime(at_least_ns=20).watch([("radio", "a")], records([
        Copy(0, 0, delivered=2, end=1), Copy(1, 20, delivered=22, end=21), Copy(2, 33, delivered=35, end=34)], 100))

    assert stretches(found) == [("radio: a", 33, 40)]
    violation, = found.violations
    assert (violation.node, violation.cause) == ("a", "frames 1 and 2 handed out 0.000000013 s apart")
    assert (found.worst, found.margin) == (pytest.approx(13e-9), pytest.approx(-7e-9))


def test_many_frames_at_one_instant_are_one_violation_though_the_radio_sends_one() -> None:
    zeno = [Copy(0, 50, delivered=60, end=55), *(Copy(number, 50, "sender busy") for number in range(1, 8))]

    handed_out = InterTransmissionTime(at_least_ns=10).watch([("radio", "a")], records(zeno, 100))
    on_air = InterTransmissionTime(at_least_ns=10, instant="on_air").watch([("radio", "a")], records(zeno, 100))

    assert stretches(handed_out) == [("radio: a", 50, 60)]
    assert handed_out.violations[0].cause == "frames 0 and 1 handed out 0 s apart, and 6 more too early after them"
    assert (on_air.violations, on_air.worst) == ((), None)


def test_copies_to_several_receivers_are_one_transmission_and_media_are_kept_apart() -> None:
    copies = [Copy(0, 0, delivered=2, end=1), Copy(0, 0, "lost", end=1, link=("radio", "a", "c")),
              Copy(0, 5, delivered=7, end=6, link=("can", "a", "b"))]

    found = InterTransmissionTime(at_least_ns=20).watch([("radio", "a"), ("can", "a")], records(copies, 50))

    assert (found.violations, found.worst, found.judged) == ((), None, True)


# --- against the definition, asked at every nanosecond

FATES = ["delivered", "delivered", "lost", "collided", "unfinished", "delivered corrupt", "sender busy"]


@st.composite
def ledgers(draw: st.DrawFn) -> tuple[list[Copy], int]:
    """Two links; frames in order, some at one instant; late copies, overtaking ones, duplicates."""
    length = draw(st.integers(1, 120))
    copies = []
    for link in (AB, CB):
        offered = sorted(draw(st.lists(st.integers(0, length - 1), max_size=12)))
        for number, time in enumerate(offered):
            end = draw(st.sampled_from([-1, time, time + 3]))
            for copy in range(draw(st.sampled_from([1, 1, 1, 2]))):
                fate = draw(st.sampled_from(FATES))
                arrival = max(time, end) + draw(st.integers(0, 40))
                if fate.startswith("delivered") and arrival >= length:
                    fate = "unfinished"
                copies.append(Copy(number, time, fate, arrival if fate.startswith("delivered") else -1,
                                   min(end, length), copy, link))
    return draw(st.permutations(copies)), length


def by_frame(copies: Iterable[Copy], link: tuple[str, str, str]) -> list[list[Copy]]:
    own = sorted((c for c in copies if c.link == link), key=lambda c: c.number)
    return [list(group) for _, group in groupby(own, key=lambda c: c.number)]


def heard_at(frame: list[Copy]) -> int | None:
    return min((c.delivered for c in frame if c.fate == "delivered"), default=None)


@given(ledgers(), st.integers(0, 3))
@settings(max_examples=examples(80), deadline=None)
@example(([Copy(0, 0, "lost", end=50), Copy(1, 10, "lost", end=5), Copy(2, 11, delivered=20, end=12)], 60), 1)
def test_losses_agree_with_the_definition_at_every_nanosecond(ledger: tuple[list[Copy], int], at_most: int) -> None:
    copies, length = ledger

    found = SuccessiveLosses(at_most).watch([AB, CB], records(copies, length))

    expected, longest = [], 0
    for link in (AB, CB):
        frames = [frame for frame in by_frame(copies, link)
                  if heard_at(frame) is not None or all(c.fate != "unfinished" for c in frame)]
        for first in range(len(frames)):
            row = []
            while first + len(row) < len(frames) and heard_at(frames[first + len(row)]) is None:
                row.append(frames[first + len(row)])
            if not row or (first and heard_at(frames[first - 1]) is None):
                continue                                    # not the first of its row
            longest = max(longest, len(row))
            lost_at = [frame[0].end if frame[0].end >= 0 else frame[0].offered for frame in row[:at_most + 1]]
            through = heard_at(frames[first + len(row)]) if first + len(row) < len(frames) else None

            def violated(t: int, row: list[list[Copy]] = row, lost_at: list[int] = lost_at,
                         through: int | None = through) -> bool:
                return len(row) > at_most and max(lost_at) <= t and (through is None or t < through)
            expected += [(f"radio: {link[1]} -> b", *run) for run in runs(length, violated)]
    lasting = [stretch for stretch in stretches(found) if stretch[1] < stretch[2]]
    assert lasting == sorted(expected)
    assert (found.worst, found.margin) == (longest, at_most - longest)
    if all(c.copy == 0 for c in copies):        # a duplicate that is under way is judged differently there
        other = max(successive_losses(records(copies, length).ledger).values(), default=None)
        assert (other or 0) == longest


@given(ledgers(), st.integers(1, 60))
@settings(max_examples=examples(80), deadline=None)
def test_ages_agree_with_the_definition_at_every_nanosecond(ledger: tuple[list[Copy], int], bound: int) -> None:
    copies, length = ledger

    found = AgeOfInformation(bound).watch([AB, CB], records(copies, length))

    expected, oldest = [], 0
    for link in (AB, CB):
        news = [c for c in copies if c.link == link and c.fate == "delivered"]

        def age(t: int, news: list[Copy] = news) -> int:
            return t - max([0] + [c.offered for c in news if c.delivered <= t])
        expected += [(f"radio: {link[1]} -> b", *run) for run in runs(length, lambda t, age=age: age(t) >= bound)]
        oldest = max(oldest, *(age(t) + 1 for t in range(length)))      # just before t + 1
    assert stretches(found) == sorted(expected)
    assert found.worst == pytest.approx(oldest * 1e-9, rel=1e-12)
    assert found.margin == pytest.approx((bound - oldest) * 1e-9, rel=1e-12, abs=1e-24)
    assert all(violation.cause.startswith("no news since") for violation in found.violations)


@given(ledgers(), st.integers(1, 60))
@settings(max_examples=examples(80), deadline=None)
def test_gaps_agree_with_the_definition_at_every_nanosecond(ledger: tuple[list[Copy], int], bound: int) -> None:
    """Two frames within any stretch shorter than the bound."""
    copies, length = ledger

    found = InterTransmissionTime(bound).watch([("radio", "a"), ("radio", "c")], records(copies, length))

    expected, gaps = [], []
    for link in (AB, CB):
        times = [frame[0].offered for frame in by_frame(copies, link)]
        gaps += [later - earlier for earlier, later in pairwise(times)]
        expected += [(f"radio: {link[1]}", *run) for run in runs(
            length, lambda t, times=times: sum(t - bound < time <= t for time in times) >= 2)]
    assert stretches(found) == sorted(expected)
    assert found.worst == (pytest.approx(min(gaps) * 1e-9, rel=1e-12) if gaps else None)

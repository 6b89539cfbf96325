"""Requests that wait for their answers: one at a time, or overlapping where looks take a known time."""

from agents.tracking.look_frames import UNASKED
from agents.tracking.looks_under_way import LooksUnderWay


def test_without_a_delay_the_next_request_gives_the_last_one_up():
    looks = LooksUnderWay()

    assert [looks.ask(0), looks.ask(10), looks.ask(5)] == [0, 1, 1]         # also if the clock is set back
    assert (looks.answered(1), looks.answered(2), looks.answered(2)) == (None, 5, None)
    assert looks.ask(20) == 0


def test_with_a_delay_requests_overlap_and_an_answer_gives_up_those_before_it():
    looks = LooksUnderWay(delay_ns=100)
    for at_ns in (0, 30, 60, 90):
        assert looks.ask(at_ns) == 0

    assert looks.answered(1) == 30
    assert (looks.answered(0), looks.answered(3), looks.waiting) == (None, 90, False)


def test_a_request_is_overdue_once_after_twice_the_delay():
    looks = LooksUnderWay(delay_ns=100)
    looks.ask(0)

    assert [looks.ask(199), looks.ask(200), looks.ask(201), looks.ask(399)] == [0, 1, 0, 1]
    assert looks.answered(0) == 0           # it comes after all, and is the newest there is


def test_numbers_wrap_in_frames():
    looks = LooksUnderWay(delay_ns=100)
    looks.number = UNASKED - 2
    looks.ask(1)
    looks.ask(2)

    assert (looks.answered(UNASKED - 1), looks.answered(0)) == (1, 2)


def test_an_announcement_forgets_what_was_asked_before_it():
    looks, plain = LooksUnderWay(delay_ns=100), LooksUnderWay()
    for at_ns in (0, 30, 60):
        looks.ask(at_ns)
    plain.ask(50)

    looks.forget(30)
    plain.forget(30)

    assert (looks.answered(1), looks.answered(2), plain.waiting) == (None, 60, False)

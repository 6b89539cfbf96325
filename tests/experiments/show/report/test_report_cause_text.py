"""Causes taken apart: what monitors put into words comes out with its links and numbers."""

from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from experiments.show.report.cause_text import CauseLine, cause_lines

ESCAPE = ("pursuer_fast saw it last at 34.93 s, told at 34.97 s; pursuer_slow has never seen it; since 21.16 s radio: "
          "fast -> slow: frames 189, 190, 191, 192 and 166 more lost (impairments[1] gilbert_elliott), "
          "frame 7 collided, radio: slow -> fast: frame 3 on its way until 22.5 s, slowest 0.053375265 s "
          "(radio: fast -> center)")
NAMES = st.from_regex(r"[a-z][a-z0-9_-]{0,8}", fullmatch=True)
ENDINGS = st.sampled_from(["lost (impairments[0] bernoulli_loss)", "collided (r2)", "deaf", "queue full (40 of 40)",
                           "on its way until 7.007534 s", "delivered corrupt (impairments[3] corrupt)"])
GROUPS = st.lists(st.tuples(st.lists(st.integers(0, 10**6), min_size=1, max_size=4, unique=True),
                            st.integers(0, 300), ENDINGS), min_size=1, max_size=3)


def test_an_escape_is_a_list_of_what_was_known_and_of_what_was_lost_on_each_link() -> None:
    lines = cause_lines(ESCAPE, "rovio in view of pursuer_fast or pursuer_slow")

    assert lines == [
        CauseLine("pursuer_fast saw it last at 34.93 s, told at 34.97 s"),
        CauseLine("pursuer_slow has never seen it"),
        CauseLine("since 21.16 s:"),
        CauseLine("radio: fast -> slow: 170 frames lost (impairments[1] gilbert_elliott)", ("radio", "fast", "slow"),
                  (189, 190, 191, 192), 166),
        CauseLine("radio: fast -> slow: 1 frame collided", ("radio", "fast", "slow"), (7,)),
        CauseLine("radio: slow -> fast: 1 frame on its way until 22.5 s", ("radio", "slow", "fast"), (3,)),
        CauseLine("slowest 0.053375265 s (radio: fast -> center)")]


def test_frames_whose_cause_names_no_link_are_those_of_the_link_that_the_violation_is_on() -> None:
    lines = cause_lines("no news since the frame handed out at 5.98 s: frame 215 lost", "can: companion -> drive")

    assert lines == [CauseLine("no news since the frame handed out at 5.98 s"),
                     CauseLine("can: companion -> drive: 1 frame lost", ("can", "companion", "drive"), (215,))]


def test_frames_too_near_each_other_stay_as_they_are() -> None:
    cause = "frames 4 and 5 handed out 0.0012 s apart, and 3 more too early after them"

    assert cause_lines(cause, "radio: companion") == [CauseLine(cause)]


@given(st.lists(st.tuples(NAMES, NAMES, NAMES, GROUPS), min_size=1, max_size=3))
def test_no_frame_of_any_link_is_lost_or_given_to_another(links) -> None:
    told = ", ".join(
        f"{medium}: {sender} -> {receiver}: " + ", ".join(
            (f"frame {numbers[0]}" if len(numbers) == 1 and not more else
             f"frames {', '.join(map(str, numbers))}" + (f" and {more} more" if more else "")) + f" {how}"
            for numbers, more, how in groups)
        for medium, sender, receiver, groups in links)

    lines = cause_lines(f"a has never seen it; since 1 s {told}, slowest 0.5 s (m: a -> b)")

    assert [(line.link, line.numbers, line.more) for line in lines if line.numbers] == [
        ((medium, sender, receiver), tuple(numbers), more)
        for medium, sender, receiver, groups in links for numbers, more, _ in groups]


@given(st.text())
def test_words_of_any_kind_lose_nothing_but_separators(cause: str) -> None:
    shown = "".join(line.text for line in cause_lines(cause))

    if not re.search(r"frames? \d", cause):
        assert re.sub(r"[\s,;:]", "", shown) == re.sub(r"[\s,;:]", "", cause)

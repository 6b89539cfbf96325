"""Stretches of time, what a guarantee came to, and the events that tell of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import msgspec
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from experiments.judge.frame_copies import FrameCopies
from experiments.judge.monitors.judge import VIOLATED, events, judge
from experiments.judge.monitors.outcome import Outcome, seconds
from experiments.judge.monitors.records import Records
from experiments.judge.monitors.stretches import covered_ns, joined
from netem.records.events import Event
from netem.wire.level import Level

STRETCHES = st.lists(st.tuples(st.integers(0, 2), st.integers(0, 40), st.integers(1, 15)), max_size=15)


@dataclass(frozen=True)
class Stated:
    kind: str
    on: str
    subjects: tuple[tuple[str, ...], ...]
    fields: dict[str, Any]
    expected: Literal["holds", "violated"] = "holds"
    share: float | None = None


def reports(*told: tuple[int, str, str]) -> Records:
    return Records(100, FrameCopies.of_rows([]), {}, [Event(time, node, "gain", detail) for time, node, detail in told])


SMALL_GAIN = {"small_gain": Stated("reported", "r*.gain", (("r1", "gain"), ("r2", "gain")), {"below": 1.0})}


@given(STRETCHES)
def test_stretches_are_joined_where_they_touch_or_overlap_and_within_one_subject_only(
        found: list[tuple[int, int, int]]) -> None:
    rows = sorted((subject, start, start + length) for subject, start, length in found)
    subject, start, end = (np.array(column, dtype=np.int64) for column in zip(*rows, strict=True)) if rows else [
        np.zeros(0, dtype=np.int64)] * 3

    firsts = joined(subject, start, end)

    covered = {(s, t) for s, a, b in rows for t in range(a, b)}
    expected = sorted((s, t) for s, t in covered if (s, t - 1) not in covered)
    assert [(int(subject[k]), int(start[k])) for k in firsts] == expected
    assert covered_ns([(a, b) for _, a, b in rows]) == len({t for _, t in covered})


def test_violations_of_several_nodes_come_in_order_and_their_time_is_counted_once() -> None:
    outcome, = judge(SMALL_GAIN, reports((10, "r2", "2"), (20, "r1", "3"), (30, "r2", "0"), (50, "r1", "0")))

    standing = outcome.standing
    assert [(violation.on, violation.from_ns) for violation in outcome.violations] == [("r2.gain", 10), ("r1.gain", 20)]
    assert (standing.violations, standing.violated_ns, standing.worst, standing.margin) == (2, 40, 3.0, -2.0)
    assert (standing.requires, standing.as_expected) == ("below 1", False)
    assert standing.in_words() == ("violated 2 times, 0.00000004 s in all, first at 0.00000001 s on r2.gain: it is 2")


def test_each_violation_is_an_event_at_its_beginning_with_cause_end_and_bound() -> None:
    outcomes = judge(SMALL_GAIN, reports((10, "r2", "2"), (30, "r2", "0")))

    assert list(events(outcomes)) == [Event(10, "r2", VIOLATED, "small_gain: r2.gain: it is 2; until 0.00000003 s "
                                            "(below 1)", Level.WARNING)]


def test_what_is_expected_to_be_violated_is_as_expected_only_if_it_is() -> None:
    shown = {"g": Stated("reported", "r1.gain", (("r1", "gain"),), {"below": 1.0}, "violated")}

    assert judge(shown, reports((10, "r1", "2")))[0].standing.as_expected
    assert not judge(shown, reports((10, "r1", "0")))[0].standing.as_expected


def test_what_cannot_be_judged_is_never_as_expected_and_says_so() -> None:
    for expected in ("holds", "violated"):
        stated = Stated("reported", "r1.gain", (("r1", "gain"),), {"below": 1.0}, expected)     # type: ignore[arg-type]
        standing = judge({"g": stated}, reports())[0].standing
        assert not standing.as_expected
        assert standing.in_words() == "no node that it names told an event 'gain'"


def test_outcomes_survive_their_file_also_with_what_is_no_number() -> None:
    outcomes = judge(SMALL_GAIN, reports((10, "r1", "broken"), (20, "r2", "inf")))

    again = msgspec.json.decode(msgspec.json.encode(outcomes), type=list[Outcome])

    assert again == outcomes
    assert (again[0].standing.worst, again[0].standing.violations) == (None, 2)


def test_seconds_are_exact() -> None:
    assert [seconds(time) for time in (0, 1, 360_000_000, 10**9, 13 * 10**9 + 5)] == [
        "0 s", "0.000000001 s", "0.36 s", "1 s", "13.000000005 s"]


def test_the_order_of_the_ledger_does_not_matter() -> None:
    row = ("radio", "a", 0, "b", 0, 0, 0, 5, -1, 1, b"", "lost", "x")
    rows = [row, ("radio", "a", 1, "b", 0, 10, 10, 15, 20, 1, b"", "delivered", "")]
    stated = {"losses": Stated("successive_losses", "", (("radio", "a", "b"),), {"at_most": 0})}

    assert judge(stated, Records(100, FrameCopies.of_rows(rows))) == judge(
        stated, Records(100, FrameCopies.of_rows(rows[::-1])))

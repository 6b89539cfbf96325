"""Lists the violations of a run in order of time: of guarantees, of assumptions, of expectations.

Each moment has an instant; a link on the page moves signals, animation and slot chart to it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

from experiments.judge.monitors.judge import VIOLATED
from experiments.judge.run_data import RunData
from experiments.judge.run_result import Verdict
from experiments.show.report.cause_text import CauseLine, cause_lines
from experiments.show.report.instants import instant_of
from netem.wire.level import Level

MOST_OF_EACH = 60
ASSUMPTION = "assumption violated"


class Moment(NamedTuple):
    kind: Literal["guarantee", "assumption", "warning", "expectation"]
    what: str                           # "no_escape", "setpoint stale", "*.y.last_abs"
    on: str                             # link, signal or node
    from_ns: int | None                 # None: the violation has no instant of its own
    until_ns: int | None = None         # exclusive; None: a single instant
    cause: Sequence[CauseLine] = ()
    expected: bool = False              # the scenario expects this violation


class Moments(NamedTuple):
    shown: list[Moment]                 # by time; those without an instant last
    left_out: dict[str, int]            # guarantee or kind of event -> moments beyond `MOST_OF_EACH`

    @property
    def instants_ns(self) -> list[int]:
        return sorted({moment.from_ns for moment in self.shown if moment.from_ns is not None})


def moments(data: RunData, verdicts: Sequence[Verdict]) -> Moments:
    left_out: Counter[str] = Counter()
    found = [*_guarantees(data, left_out), *_events(data, left_out), *_expectations(data, verdicts)]
    found.sort(key=lambda moment: (moment.from_ns is None, moment.from_ns or 0, moment.kind))
    return Moments(found, dict(left_out))


def _guarantees(data: RunData, left_out: Counter[str]) -> Iterator[Moment]:
    for outcome in data.guarantees.values():
        standing = outcome.standing
        for violation in outcome.violations[:MOST_OF_EACH]:
            yield Moment("guarantee", standing.name, violation.on, violation.from_ns, violation.until_ns,
                         cause_lines(violation.cause, violation.on), standing.expected == "violated")
        if len(outcome.violations) > MOST_OF_EACH:
            left_out[standing.name] = len(outcome.violations) - MOST_OF_EACH


def _events(data: RunData, left_out: Counter[str]) -> Iterator[Moment]:
    told: Counter[str] = Counter()
    for event in data.events:
        if event.level < Level.WARNING or (event.kind == VIOLATED and data.guarantees):
            continue
        told[event.kind] += 1
        if told[event.kind] > MOST_OF_EACH:
            left_out[event.kind] += 1
            continue
        yield Moment("assumption" if event.kind == ASSUMPTION else "warning", event.kind, event.node or "emulator",
                     event.time_ns, cause=[CauseLine(event.detail)] if event.detail else [])


def _expectations(data: RunData, verdicts: Sequence[Verdict]) -> Iterator[Moment]:
    bounds = data.scenario.get("expect") or {}
    for verdict in verdicts:
        if verdict.holds:
            continue
        window = (bounds.get(verdict.key) or {}).get("during_ns")
        instant = instant_of(verdict, None if window is None else (window[0], window[1]), data)
        value = "no figure" if verdict.value is None else f"{verdict.value:.5g}"
        yield Moment("expectation", verdict.key, instant.words if instant else "over the whole run",
                     instant.time_ns if instant else None, cause=[CauseLine(f"{value}: {verdict.by_how_much()}")])

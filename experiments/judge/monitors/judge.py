"""Judges the guarantees of a run by its records; returns their outcomes, and an event for each violation."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Protocol

from experiments.judge.monitors import Monitor
from experiments.judge.monitors.outcome import Expected, Outcome, Standing, finite, seconds
from experiments.judge.monitors.records import Records
from experiments.judge.monitors.stretches import covered_ns
from experiments.scenario.guarantee_kinds import MONITORS
from experiments.scenario.subjects import Subject
from netem.records.events import Event
from netem.wire.level import Level

VIOLATED = "guarantee violated"


class Guarantee(Protocol):
    """A guarantee as the scenario states it; `fields` are those of `MONITORS[kind]`."""

    @property
    def kind(self) -> str: ...
    @property
    def on(self) -> str: ...
    @property
    def subjects(self) -> tuple[Subject, ...]: ...
    @property
    def expected(self) -> Expected: ...
    @property
    def share(self) -> float | None: ...
    @property
    def fields(self) -> Mapping[str, Any]: ...


def judge(guarantees: Mapping[str, Guarantee], records: Records) -> list[Outcome]:
    """Return the outcome of each guarantee, in the order of the scenario."""
    return [_outcome(name, guarantee, records) for name, guarantee in guarantees.items()]


def events(outcomes: Iterable[Outcome]) -> Iterator[Event]:
    """Yield an event for each violation, at the instant at which it begins."""
    for outcome in outcomes:
        for violation in outcome.violations:
            detail = (f"{outcome.standing.name}: {violation.on}: {violation.cause}; "
                      f"until {seconds(violation.until_ns)} ({outcome.standing.requires})")
            yield Event(violation.from_ns, violation.node, VIOLATED, detail, Level.WARNING)


def _outcome(name: str, guarantee: Guarantee, records: Records) -> Outcome:
    monitor: Monitor = MONITORS[guarantee.kind](**guarantee.fields)
    finding = monitor.watch(guarantee.subjects, records)
    violations = sorted(finding.violations, key=lambda violation: (violation.from_ns, violation.on))
    violated_ns = covered_ns([(violation.from_ns, violation.until_ns) for violation in violations])
    standing = Standing(name, guarantee.kind, guarantee.on, monitor.requires(), monitor.UNIT, guarantee.expected,
                        finding.judged, len(violations), violations[0] if violations else None, violated_ns,
                        finite(finding.worst), finite(finding.margin), finding.why, guarantee.share)
    return Outcome(standing, violations)

"""Judges the guarantees of a scenario after its run has ended or was aborted, from samples and events kept until then.

    samples, events -> kept here, samples if a guarantee is about signals, sights or a formula
    ledger closed -> monitors -> outcomes, one event for each violation -> signals closed

In a run without guarantees it keeps no samples and no events.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import msgspec

from experiments.judge.derived_signals import derive
from experiments.judge.frame_copies import FrameCopies
from experiments.judge.monitors.judge import events, judge
from experiments.judge.monitors.outcome import Outcome, Standing
from experiments.judge.monitors.records import Records
from experiments.scenario.guarantee_kinds import MONITORS
from experiments.scenario.model import Scenario
from experiments.scenario.problems import ScenarioError, near
from experiments.scenario.subjects import Named
from netem.records import Feed
from netem.records.events import Event, in_order
from netem.records.kept_samples import KeptSamples
from netem.records.signal_table import SignalTable, with_deaths

Declared = Mapping[str, Sequence[tuple[str, str]]]
Deaths = Mapping[str, Sequence[tuple[int, int]]]


class GuaranteeWatch:
    def __init__(self, scenario: Scenario, feed: Feed) -> None:
        self._scenario = scenario
        self._feed = feed
        self._events: list[Event] = []
        self._declared: Declared = {}
        needs = {MONITORS[guarantee.kind].ON for guarantee in scenario.guarantees.values()}
        self._samples = KeptSamples() if needs & {Named.SIGNALS, Named.SIGHTS, Named.FORMULA} else None
        if self._samples is not None:
            feed.samples.append(self._samples.append)
        if scenario.guarantees:
            feed.events.append(self._events.append)
        self.standings: list[Standing] = []

    def admit(self, declared: Declared) -> None:
        """Take the (signal, unit) pairs that each node records.

        Raises ScenarioError for a guarantee about a signal that no node records, or about a body whose position its
        node does not record.
        """
        self._declared = declared
        unknown = []
        for name, guarantee in self._scenario.guarantees.items():
            agents = [subject for subject in guarantee.subjects if subject[0] not in self._scenario.derived]
            if MONITORS[guarantee.kind].ON is not Named.SIGNALS or len(agents) < len(guarantee.subjects):
                continue
            known = dict.fromkeys(signal for node, _ in agents for signal, _ in declared.get(node, ()))
            if not any(signal in (known_name for known_name, _ in declared.get(node, ())) for node, signal in agents):
                unknown.append(f"{Path(self._scenario.path).name}: guarantees.{name}.on={guarantee.on!r}: "
                               f"no such signal; {near(agents[0][1], known)}")
        unknown += self._unrecorded()
        if unknown:
            raise ScenarioError(unknown)

    def _unrecorded(self) -> Iterator[str]:
        """Yield a problem for each body whose outputs, as its medium names them, are not all signals of its node."""
        for name, guarantee in self._scenario.guarantees.items():
            if MONITORS[guarantee.kind].ON is not Named.SIGHTS:
                continue
            missing: dict[tuple[str, str], str] = {}
            for medium, target, observer in guarantee.subjects:
                settings = self._scenario.media[medium].settings
                poses = settings.poses()
                for body in (target, settings.camera(observer).carrier or observer):
                    known = [signal for signal, _ in self._declared.get(body, ())]
                    seen = poses[body].outputs if body in poses else ()
                    unknown = [output for output in seen if output not in known]
                    missing |= {(medium, body): unknown[0]} if unknown else {}
            for (medium, body), output in missing.items():
                yield (f"{Path(self._scenario.path).name}: guarantees.{name}: media.{medium}.bodies.{body}: its "
                       f"program records no signal {output!r}; it has to sample where it is under the names of the "
                       f"plant's outputs")

    def judge(self, copies: FrameCopies, reached_ns: int, dead_ns: Deaths) -> list[Outcome]:
        """Judge the guarantees over [0, reached_ns) by the frame copies of the run; record an event per violation.

        `dead_ns` are the intervals [start, end) in which faults had killed nodes, by node.
        """
        sights = {name: medium.settings for name, medium in self._scenario.media.items() if medium.settings.poses()}
        records = Records(reached_ns, copies, self._signals(dead_ns), in_order(self._events), sights)
        outcomes = judge(self._scenario.guarantees, records)
        for event in events(outcomes):
            self._feed.event(event)
        self.standings = [outcome.standing for outcome in outcomes]
        return outcomes

    def _signals(self, dead_ns: Deaths) -> dict[str, SignalTable]:
        if self._samples is None:
            return {}
        derived = {name: msgspec.to_builtins(spec) for name, spec in self._scenario.derived.items()}
        tables = with_deaths(self._samples.tables(self._declared), dead_ns)
        return derive(derived, tables, self._scenario.folder, [])

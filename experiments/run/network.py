"""The network of a run: the media of a scenario, and the impairments on their links.

    scenario.media --MEDIA--> media --received copies--> links --scenario.impairments--> nodes
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from random import Random
from typing import Any

from experiments.scenario.impairment_kind import impairment_class
from experiments.scenario.model import ImpairmentSpec, Scenario, positions
from netem.core.agenda import Agenda
from netem.core.link_name import LinkName
from netem.core.random_streams import stream
from netem.impairments import Impairment
from netem.impairments.construct import construct_impairment
from netem.impairments.contract import written_out
from netem.impairments.recordings import Recordings
from netem.impairments.shared import Shared
from netem.impairments.traced import Trace
from netem.impairments.window import Window
from netem.media.links import Deliver, Links
from netem.media.medium import Medium
from netem.media.observation import MediumObserver
from netem.media.table import MEDIA
from netem.records import Feed
from netem.records.events import Event
from netem.records.ledger import Ledger


class Network:
    """`links` are the links of the scenario with its impairments, which `trace` watches, unless others are given."""

    def __init__(self, scenario: Scenario, agenda: Agenda, ledger: Ledger, deliver: Deliver,
                 links: Links | None = None, trace: Trace | None = None) -> None:
        self.links = links = links or Links(ledger, deliver, _pipelines(scenario, trace))
        self.media: dict[str, Medium] = {
            name: MEDIA[spec.kind](name, spec.settings, positions(spec.nodes, scenario.agents), agenda, ledger, links,
                                   partial(stream, scenario.seed)) for name, spec in scenario.media.items()}

    def observe(self, feed: Feed, event: Callable[[Event], None]) -> None:
        """Subscribe `feed` to the samples of the media, and `event` to their events."""
        for name, medium in self.media.items():
            if medium.signals:
                feed.declare(name, medium.signals)
            for table, signals in medium.tables().items():
                feed.declare(table, signals)
            medium.observe(MediumObserver(event, feed.sampler()))

    def changes_ns(self, until_ns: int) -> dict[str, Sequence[int]]:
        return {name: medium.changes_ns(until_ns) for name, medium in self.media.items()}

    def add_counters(self, counters: dict[str, dict[str, int]]) -> None:
        """Add the counters of the media to `counters` by node; those of a medium itself are under its name."""
        for medium in self.media.values():
            for node, found in medium.counters().items():
                own = counters.setdefault(node, {})
                for name, count in found.items():
                    own[name] = own.get(name, 0) + count

    def finish(self, end_ns: int) -> None:
        for medium in self.media.values():
            medium.finish(end_ns)


def _pipelines(scenario: Scenario, trace: Trace | None) -> dict[LinkName, list[tuple[str, Impairment]]]:
    """Return the impairments of each directed link, in the order of the scenario.

    Each has its own random stream on each link, or one for all links if they share it.
    """
    pipelines: dict[LinkName, list[tuple[str, Impairment]]] = {}
    recordings = Recordings()
    for spec in scenario.impairments:
        kind = impairment_class(spec.kind, scenario.folder)
        shared: Any = Shared(_impairment(scenario, spec, kind, "shared", recordings)) if spec.shared else None
        for link in spec.links:
            impairment = shared or _impairment(scenario, spec, kind, f"{link[0]}: {link[1]} -> {link[2]}", recordings)
            if trace is not None and is_written_out(scenario, spec):
                impairment = trace.watch(spec.cause, link, impairment)
            pipelines.setdefault(link, []).append((spec.cause, impairment))
    return pipelines


def is_written_out(scenario: Scenario, spec: ImpairmentSpec) -> bool:
    """Return whether a search writes out what the impairment does, copy by copy."""
    kind = impairment_class(spec.kind, scenario.folder)
    return written_out(construct_impairment(kind, spec.fields, Random(0), Recordings()))


def _impairment(scenario: Scenario, spec: ImpairmentSpec, kind: Any, place: str, recordings: Recordings) -> Any:
    rng = stream(scenario.seed, f"{spec.called}/{place}")
    impairment = construct_impairment(kind, spec.fields, rng, recordings)
    return Window(impairment, spec.windows_ns) if spec.windows_ns else impairment

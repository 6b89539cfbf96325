"""Finds links on which a value may arrive a slot or more after its slot began, so that stability is not proved.

    delay = airtime + receive latency + the most that the impairments of the link add,   expected < slot

The bounds of (6.20) assume instantaneous transmission, and the exact loop (`exact_loop`) assumes that it is shorter
than a slot. Checked are the links of every graph that the robots work with, told or discovered, with that graph's slot.

An impairment adds at most the greatest value of its distribution that the random generator can give, the longest
delay of a recording, the hold of `reorder`, the extra delay of a twin, the queue of `rate_limit` under the frames that
a robot sends, or all senders on the links that share it. An impairment in a window counts if the window begins before
the run ends.

Not modelled: an impairment without `most_delay_ns`; with one, the robots watch the age of received values instead.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from random import Random
from typing import Final

import numpy as np

from agents.synchronization.graph import Floats
from agents.synchronization.team import Team
from firmware_sim.scenario_view import ImpairmentView
from netem.core.link_name import LinkName
from netem.impairments import Impairment
from netem.impairments.construct import construct_impairment
from netem.impairments.flow import Flow
from netem.impairments.recordings import Recordings
from netem.impairments.table import IMPAIRMENTS

UNKNOWN: Final = -1


@dataclass(frozen=True)
class AddedDelay:
    most_ns: int = 0
    places: tuple[str, ...] = ()        # the impairments that add delay, by their place in the scenario
    known: bool = True                  # False: the delay of one of them has no known bound


def constructed(impairments: Sequence[ImpairmentView]) -> Iterator[tuple[ImpairmentView, Impairment | None]]:
    """Yield each impairment as it is written and as constructed; None for a class of the scenario's author."""
    recordings = Recordings()
    for spec in impairments:
        kind = IMPAIRMENTS.get(spec.kind)
        yield spec, None if kind is None else construct_impairment(kind, spec.fields, Random(0), recordings)


def added_delays(impairments: Sequence[ImpairmentView], flow: Flow, length_ns: int) -> dict[LinkName, AddedDelay]:
    """Return for each link with impairments the most delay that they add."""
    delays: dict[LinkName, AddedDelay] = {}
    flows: dict[LinkName, Flow] = defaultdict(lambda: flow)
    for spec, impairment in constructed(impairments):
        if spec.windows_ns and all(start_ns >= length_ns for start_ns, _ in spec.windows_ns):
            continue
        for link in spec.links:
            before = delays.get(link, AddedDelay())
            if impairment is None:
                delays[link] = replace(before, known=False)
                continue
            senders = len({sender for _, sender, _ in spec.links}) if spec.shared else 1
            most_ns = impairment.most_delay_ns(replace(flows[link], sizes_bytes=flows[link].sizes_bytes * senders))
            delays[link] = replace(before, most_ns=before.most_ns + most_ns,
                                   places=(*before.places, spec.place) if most_ns else before.places)
            flows[link] = replace(flows[link], copies=flows[link].copies * impairment.most_copies)
    return delays


def late_values(team: Team, medium: str, graphs: Mapping[str, Floats], slots_ns: Mapping[str, int],
                delays: Mapping[LinkName, AddedDelay]) -> Iterator[str]:
    """Yield one sentence for each set of impairments and delay; it names the graph with the shortest slot."""
    own_ns = team.layout.data_airtime_ns + team.layout.latency_ns
    found: dict[tuple[tuple[str, ...], int], dict[LinkName, None]] = defaultdict(dict)
    shortest: dict[tuple[tuple[str, ...], int], str] = {}
    for name, slot_ns in sorted(slots_ns.items(), key=lambda item: item[1]):
        for link in _links(team, medium, graphs[name]):
            added = delays.get(link, AddedDelay())
            if added.most_ns and own_ns + added.most_ns >= slot_ns:
                key = (added.places, added.most_ns)
                found[key][link] = None
                shortest.setdefault(key, name)
    for (places, most_ns), links in found.items():
        _, sender, receiver = next(iter(links))
        others = f" and {len(links) - 1} more" if len(links) > 1 else ""
        name = shortest[places, most_ns]
        yield (f"{' and '.join(places)}: {medium}: {sender} -> {receiver}{others}: a value may come "
               f"{own_ns + most_ns} ns after its slot began, {most_ns} ns of them by impairments: expected less than "
               f"{slots_ns[name]} ns, the slot of {name}, or nothing proves that the team synchronizes ((6.20) takes "
               "no delay, the exact loop less than a slot); shorten the delay, or set team.sure = false to run it "
               "all the same")


def oldest_value_ns(team: Team, medium: str, graphs: Mapping[str, Floats],
                    delays: Mapping[LinkName, AddedDelay]) -> int:
    """Return the greatest age that a value of a checked link can have on arrival; UNKNOWN if a delay has no bound."""
    links = [link for graph in graphs.values() for link in _links(team, medium, graph)]
    added = [delays[link] for link in links if link in delays]
    if not all(delay.known for delay in added):
        return UNKNOWN
    return team.layout.data_airtime_ns + team.layout.latency_ns + max((delay.most_ns for delay in added), default=0)


def _links(team: Team, medium: str, graph: Floats) -> Iterator[LinkName]:
    for receiver, sender in np.argwhere(graph < 0):
        yield medium, team.names[sender], team.names[receiver]

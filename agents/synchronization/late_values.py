"""Finds delays of the links with which stability is not proved, in every graph that the robots work with.

    delay = airtime + receive latency + the most that the impairments of the link add

The bounds of (6.20) assume instantaneous transmission. Constant delays of any length are judged by the spectral radius
of the exact map of a round (`delayed_loop`), which has to be below 1. For a delay that varies there is no such map: it
has to be shorter than a slot, and is then judged as if it always had its greatest value. So it has if a graph that is
discovered changes in the run, since robots would fall back to the slots of the start at every change.

An impairment adds at most the greatest value of its distribution that the random generator can give, the longest
delay of a recording, the hold of `reorder`, the extra delay of a twin, the queue of `rate_limit` under the frames that
a robot sends, or all senders on the links that share it. An impairment in a window counts if the window begins before
the run ends, and is judged as if it lasted.

Not modelled: changes of the graph while values are on their way; an impairment without `most_delay_ns`. With one, the
robots watch the age of received values instead.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from random import Random
from typing import Final

import msgspec
import numpy as np

from agents.synchronization.check import judgement, stable_delay
from agents.synchronization.delayed_loop import DelayedLoop, Delays
from agents.synchronization.graph import Floats
from agents.synchronization.round_plan import RoundPlan
from agents.synchronization.team import Team
from firmware_sim.scenario_view import ImpairmentView
from netem.core.link_name import LinkName
from netem.impairments import Impairment
from netem.impairments.construct import construct_impairment
from netem.impairments.flow import Flow
from netem.impairments.recordings import Recordings
from netem.impairments.table import IMPAIRMENTS
from netem.wire.instants import in_ms

UNKNOWN: Final = -1


@dataclass(frozen=True)
class AddedDelay:
    most_ns: int = 0
    least_ns: int = 0
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
            least_ns = impairment.least_delay_ns(flow.sizes_bytes[0])
            delays[link] = replace(before, most_ns=before.most_ns + most_ns, least_ns=before.least_ns + least_ns,
                                   places=(*before.places, spec.place) if most_ns else before.places)
            flows[link] = replace(flows[link], copies=flows[link].copies * impairment.most_copies)
    return delays


def late_values(team: Team, medium: str, plans: Mapping[str, RoundPlan],
                added: Mapping[LinkName, AddedDelay]) -> Iterator[str]:
    """Yield one sentence for each set of impairments and delay that is not proved to be harmless.

    `plans` are those of all graphs, by the graph's name; `team` is that of `prepare`, with layout and own delays."""
    varying = _longer_than_a_slot(team, medium, plans, added)
    yield from varying.values()
    found: dict[tuple[tuple[str, ...], int], tuple[int, str]] = {}
    for name, plan in plans.items():
        late = {link: added[link] for link in _links(team, medium, plan.laplacian)
                if link in added and added[link].most_ns}
        places = tuple(dict.fromkeys(place for delay in late.values() for place in delay.places))
        if not late or any(set(places) & set(refused) for refused, _ in varying):
            continue
        loop = delayed_loop(team, medium, plan, added)
        radius = loop.spectral_radius()
        if radius is not None and radius < 1:
            continue
        most_ns = max(delay.most_ns for delay in late.values())
        first = next(link for link in late if late[link].most_ns == most_ns)
        longest_ns = loop.longest_stable_ns or 0
        sentence = (f"{_place(places, first, len(late))}: a value may come {in_ms(team.data_delay_ns + most_ns)} after "
                    f"its slot began, {in_ms(most_ns)} of them by impairments: {judgement(radius)}, with slots of "
                    f"{in_ms(plan.slot_ns)} for {name} and a sender that uses its own value {_own(team)}; "
                    f"{stable_delay(loop)}; shorten the delay{_later(team, medium, plan, added, longest_ns)}, or set "
                    "team.sure = false to run it all the same")
        if (places, most_ns) not in found or longest_ns < found[places, most_ns][0]:
            found[places, most_ns] = longest_ns, sentence
    yield from (sentence for _, sentence in found.values())


def delayed_loop(team: Team, medium: str, plan: RoundPlan, added: Mapping[LinkName, AddedDelay]) -> DelayedLoop:
    """Return the exact loop of a plan with the delays of its links, each at its greatest value."""
    links_ns = {(team.names.index(sender), team.names.index(receiver)):
                team.data_delay_ns + added.get((name, sender, receiver), AddedDelay()).most_ns
                for name, sender, receiver in _links(team, medium, plan.laplacian)}
    own_ns = tuple(team.own_delay_ns(number) for number in range(len(team.names)))
    return DelayedLoop(tuple(team.agents), plan.laplacian, plan.slot_ns, Delays(links_ns, own_ns))


def assumed_ns(team: Team, medium: str, plan: RoundPlan, added: Mapping[LinkName, AddedDelay]) -> int:
    """Return the longest delay of the plan's links if it is a slot or more, or added by impairments, and the loop is
    proved to be stable all the same; otherwise 0."""
    delayed = any(link in added and added[link].most_ns for link in _links(team, medium, plan.laplacian))
    if not delayed and team.data_delay_ns < plan.slot_ns:
        return 0
    if _longer_than_a_slot(team, medium, {"": plan}, added):
        return 0
    loop = delayed_loop(team, medium, plan, added)
    return loop.delays.longest_link_ns if loop.is_stable else 0


def own_late_ns(team: Team, medium: str, graphs: Iterable[Floats], added: Mapping[LinkName, AddedDelay]) -> list[int]:
    """Return for each robot the most that impairments delay its values on the way to a robot that uses them."""
    late_ns = [0] * len(team.names)
    for graph in graphs:
        for link in _links(team, medium, graph):
            number = team.names.index(link[1])
            late_ns[number] = max(late_ns[number], added.get(link, AddedDelay()).most_ns)
    return late_ns


def _longer_than_a_slot(team: Team, medium: str, plans: Mapping[str, RoundPlan],
                      added: Mapping[LinkName, AddedDelay]) -> dict[tuple[tuple[str, ...], int], str]:
    """Return one sentence for each set of impairments and greatest delay of a slot or more for which there is no exact
    map, or which keeps discovery from ending; it names the graph with the shortest slot."""
    changes = team.topology == "discovered" and len(plans) > 1
    found: dict[tuple[tuple[str, ...], int], dict[LinkName, None]] = defaultdict(dict)
    shortest: dict[tuple[tuple[str, ...], int], str] = {}
    for name, plan in sorted(plans.items(), key=lambda item: item[1].slot_ns):
        for link in _links(team, medium, plan.laplacian):
            delay = added.get(link, AddedDelay())
            may_be_longer = delay.most_ns == delay.least_ns and not changes
            if delay.most_ns and not may_be_longer and team.data_delay_ns + delay.most_ns >= plan.slot_ns:
                key = (delay.places, delay.most_ns)
                found[key][link] = None
                shortest.setdefault(key, name)
    sentences = {}
    for (places, most_ns), links in found.items():
        name = shortest[places, most_ns]
        which, why, remedy = (
            ("the graph changes in the run", "control frames as late make the team fall back to the slots of the start "
             "at each change", "shorten the delay, tell the robots the topology") if changes else
            ("the delay varies", "nothing proves that the team synchronizes ((6.20) takes no delay, the exact loop a "
             "constant one)", "make the delay constant or shorter"))
        sentences[places, most_ns] = (
            f"{_place(places, next(iter(links)), len(links))}: a value may come {in_ms(team.data_delay_ns + most_ns)} "
            f"after its slot began, {in_ms(most_ns)} of them by impairments, and {which}: expected less than "
            f"{in_ms(plans[name].slot_ns)}, the slot of {name}, or {why}; {remedy}, or set team.sure = false to run it "
            "all the same")
    return sentences


def _place(places: Sequence[str], link: LinkName, links: int) -> str:
    medium, sender, receiver = link
    return f"{' and '.join(places)}: {medium}: {sender} -> {receiver}{f' and {links - 1} more' if links > 1 else ''}"


def _own(team: Team) -> str:
    return "as late as its neighbours" if team.own_value == "late" else "at once"


def _later(team: Team, medium: str, plan: RoundPlan, added: Mapping[LinkName, AddedDelay], longest_ns: int) -> str:
    """Return what the other convention of own values makes of the delay: a remedy, a longer limit, or nothing."""
    loop = delayed_loop(msgspec.structs.replace(team, own_value="late"), medium, plan, added)
    if loop.is_stable:
        return ', or set team.own_value = "late", with which this delay is stable'
    late_ns = loop.longest_stable_ns or 0
    return f' (with team.own_value = "late" it is stable up to {in_ms(late_ns)})' if late_ns > longest_ns else ""


def oldest_value_ns(team: Team, medium: str, graphs: Mapping[str, Floats],
                    delays: Mapping[LinkName, AddedDelay]) -> int:
    """Return the greatest age that a value of a checked link can have on arrival; UNKNOWN if a delay has no bound."""
    links = [link for graph in graphs.values() for link in _links(team, medium, graph)]
    added = [delays[link] for link in links if link in delays]
    if not all(delay.known for delay in added):
        return UNKNOWN
    return team.data_delay_ns + max((delay.most_ns for delay in added), default=0)


def _links(team: Team, medium: str, graph: Floats) -> Iterator[LinkName]:
    for receiver, sender in np.argwhere(graph < 0):
        yield medium, team.names[sender], team.names[receiver]

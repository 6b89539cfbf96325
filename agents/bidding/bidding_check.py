"""Problems of a scenario whose sensors bid, found before a run: each with the number that would do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import ceil

from agents.bidding.bid_timing import BiddingSettings, BidTiming
from agents.bidding.bidding import sensors_of
from firmware_sim.scenario_view import MediumView, Own, ScenarioView


def bidding_problems(scenario: ScenarioView, own: Own[BiddingSettings]) -> Iterator[str]:
    """Yield the reasons why these sensors cannot keep what `bid_timing` promises over their radio."""
    try:
        sensors = sensors_of(scenario.team)
    except ValueError as error:
        yield str(error)
        return
    if unknown := [name for name in sensors if name not in scenario.agents]:
        yield f"team.sensors: {', '.join(unknown)}: no such agents; there are {', '.join(scenario.agents)}"
    yield from (f"agents.{name}: is not in team.sensors, {', '.join(sensors)}; a sensor that bids has a number there"
                for name in own if name not in sensors)
    lead = next((name for name in sensors if name in scenario.agents
                 and "slot_ns" in scenario.agents[name].parameters), next(iter(own)))
    given = scenario.agents[lead].parameters
    expected = {key: given.get(key, field.default) for key, field in BiddingSettings.__dataclass_fields__.items()}
    for name, agent in own.items():
        yield from (f"agents.{name}.parameters.{key}={getattr(agent.settings, key)}: expected {value}, as agents."
                    f"{lead} has it: the slots of a team are the same" for key, value in expected.items()
                    if getattr(agent.settings, key) != value)
    if lead not in own:
        return                          # the check of its program judges what is the same for all
    first = own[lead].settings
    medium = scenario.media.get(first.radio)
    if medium is None or medium.settings.radio() is None:
        yield f"media.{first.radio}: bidding needs a broadcast_radio of this name, or its name as parameter radio"
        return
    if absent := [name for name in sensors if name in scenario.agents and name not in medium.nodes]:
        yield f"media.{first.radio}: lacks {', '.join(absent)}: each sensor needs a port on it"
    yield from _slot_problems(scenario, medium, BidTiming(len(sensors), first), f"agents.{lead}.parameters")


def _slot_problems(scenario: ScenarioView, medium: MediumView, timing: BidTiming, place: str) -> Iterator[str]:
    """Yield what is wrong with the parameters at `place`, which are those of all sensors of the team."""
    settings, radio, size = timing.settings, medium.settings.radio(), timing.most_bytes
    if medium.settings.mac_defers:
        yield f'media.{medium.name}.mac="{medium.settings.mac}": expected "none", a slot decides who may send'
    if radio.max_payload_bytes is not None and size > radio.max_payload_bytes:
        yield (f"{place}.most_tasks={settings.most_tasks}: a frame of so many tasks has up to {size} bytes, media."
               f"{medium.name} carries {radio.max_payload_bytes}; take fewer, or a radio with longer frames")
    clocks = {name: scenario.agents[name].clock for name in medium.nodes if name in scenario.agents}
    ppm = [clock.drift_ppm for clock in clocks.values()]
    offsets_ns = [clock.offset_ns for clock in clocks.values()]
    apart_ns = max(offsets_ns) - min(offsets_ns) + ceil((max(ppm) - min(ppm)) * 1e-6 * scenario.length_ns)
    needed_ns = radio.airtime_ns(size) + radio.receive_latency_ns + apart_ns
    if settings.slot_ns < needed_ns:
        yield (f"{place}.slot_ns={settings.slot_ns}: shorter than a frame of {size} bytes: "
               f"{radio.airtime_ns(size)} ns on the air, {radio.receive_latency_ns} ns of latency, {apart_ns} ns "
               f"between the clocks; take at least {needed_ns} ns")
    yield from _hop_problems(scenario, medium, timing, place)
    least_ns = timing.least_window_ns + ceil(round(timing.least_window_ns * (max(ppm) - min(ppm)) * 1e-6, 6))
    if settings.window_ns < least_ns:
        hops = f", for each of {settings.most_hops} hops" if timing.floods else ""
        yield (f"{place}.window_ns={settings.window_ns}: the bid window is shorter than its frames: "
               f"{timing.frames} rounds of {timing.sensors} slots of {settings.slot_ns} ns until all have "
               f"heard of it{hops}, and as many until all have heard the bids; take at least {least_ns} ns")
    delayed = _delays(scenario, medium.name, size, timing.round_ns)
    if (most_ns := max(delayed.values(), default=0)) > settings.delay_ns:
        by = max(delayed, key=lambda name: delayed[name])
        yield (f"{place}.delay_ns={settings.delay_ns}: {by} delays a copy by up to {most_ns} ns; take that much, "
               "which lengthens the window")


def _hop_problems(scenario: ScenarioView, medium: MediumView, timing: BidTiming, place: str) -> Iterator[str]:
    """Yield how many hops sensors of a radio with a constant graph are apart, if that is more than `most_hops`."""
    from agents.radio_topology import topology_of

    topology = topology_of(scenario, medium)
    if topology.moves or topology.changes_ns(scenario.length_ns):
        return
    sensors = [name for name in sensors_of(scenario.team) if name in medium.nodes]
    links = [link for link in topology.graph_at(0) if set(link) <= set(sensors)]
    if len(links) == len(sensors) * (len(sensors) - 1):
        return
    import networkx as nx

    graph = nx.DiGraph(links)
    graph.add_nodes_from(sensors)
    if not nx.is_strongly_connected(graph):
        for one in sensors:
            if unheard := [other for other in sensors if other not in nx.descendants(graph, one) | {one}]:
                yield (f"media.{medium.name}: nothing that {one} sends reaches {unheard[0]}, over any number of hops; "
                       "add a link, or a sensor that passes it on")
                return
    apart, one, other = max((hops, one, other) for one, ways in nx.all_pairs_shortest_path_length(graph)
                            for other, hops in ways.items())
    if apart > timing.settings.most_hops:
        yield (f"{place}.most_hops={timing.settings.most_hops}: on media.{medium.name} {other} hears {one} over "
               f"{apart} hops; take {apart}, which lengthens the window")


def _delays(scenario: ScenarioView, medium: str, size_bytes: int, every_ns: int) -> Mapping[str, int]:
    """Return the most delay that impairments add on a link of the medium, by the places of those."""
    from agents.synchronization.late_values import added_delays  # late: a robot's process needs no impairments
    from netem.impairments.flow import Flow

    found: dict[str, int] = {}
    for link, delay in added_delays(scenario.impairments, Flow((size_bytes,), every_ns), scenario.length_ns).items():
        if link[0] == medium and delay.most_ns:
            place = " and ".join(delay.places)
            found[place] = max(found.get(place, 0), delay.most_ns)
    return found

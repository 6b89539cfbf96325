"""Checks a synchronization scenario before its run, and prepares the team table of its robots.

`check` yields the reasons why a run cannot work, with the equation that fails and the number. `prepare` adds to the
team table frame times (`layout`) and the round plans of the graphs that will occur (`designs`). Both take the resolved
scenario.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import msgspec
import numpy as np

from agents.radio_topology import NoSharedRadio, shared_radio, topology_of
from agents.synchronization.check import problems
from agents.synchronization.discovery_frame import MAX_NODES, frame_bytes
from agents.synchronization.graph import Floats, laplacian
from agents.synchronization.hold_check import late_for_models, model_problems, observer_problems
from agents.synchronization.late_control_frames import late_control_frames
from agents.synchronization.late_values import (
    AddedDelay,
    added_delays,
    assumed_ns,
    late_values,
    oldest_value_ns,
    own_late_ns,
)
from agents.synchronization.model_hold import Hold
from agents.synchronization.partition import colliding_pairs
from agents.synchronization.round_plan import RoundPlan
from agents.synchronization.round_plans import RoundPlans, heard_by
from agents.synchronization.sync_frame import SyncFrameCodec
from agents.synchronization.team import SYNC_GAIN, Layout, Team, TeamError, read_team
from firmware_sim.scenario_view import MediumView, Own, ScenarioView
from firmware_sim.slot_sync_condition import contraction_per_round
from netem.core.link_name import LinkName
from netem.impairments.flow import Flow
from netem.topology import Topology


def check(scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
    """Yield every reason why these robots cannot synchronize over their medium."""
    try:
        team = read_team(scenario.team)
        medium = shared_radio(scenario, team.names, "every robot has to know every other's model")
    except TeamError as error:
        yield from error.problems
        return
    except NoSharedRadio as error:
        yield str(error)
        return
    if team.topology == "discovered" and len(team.names) > MAX_NODES:
        yield f"team.models: {len(team.names)} robots: a discovery frame names at most {MAX_NODES}"
        return
    layout = frame_layout(team, medium)
    team = msgspec.structs.replace(team, layout=layout)
    graphs = occurring_graphs(team, scenario, medium)
    plans = RoundPlans(team)
    if not graphs and team.sure:
        yield ("media: the links follow the robots, so the graphs that the team discovers are not known before the run "
               "and nothing proves that it synchronizes: tell it the topology, or set team.sure = false to run it all "
               "the same")
    judged: dict[str, RoundPlan] = {}
    for name, graph in graphs.items():
        plan = plans.plan(graph)
        slot_ns = plan.slot_ns if plan is not None else 0
        found = problems(team.agents, graph, slot_ns=slot_ns, airtime_ns=team.slot_needs_ns, names=team.names,
                         delay_ns=team.data_delay_ns,
                         discovered=team.topology == "discovered",
                         sure=team.sure and team.hold is Hold.VALUE)
        if plan is None and not found:
            found = [f"team.slot_quantum_s={team.slot_quantum_s}: longer than the slot that (6.20) allows"]
        if plan is not None and not found:
            found = [*observer_problems(team, plan), *model_problems(team, plan)]
        yield from (f"{name}: {problem}" for problem in found)
        if plan is not None and not found:
            judged[name] = plan
        if plan is not None and team.resynchronize:
            yield from (f"{name}: {problem}" for problem in _clock_problems(team, plan, layout))
    if team.topology == "discovered" and team.boot_slot_s * 1e9 < team.slot_needs_ns:
        yield (f"team.boot_slot_s={team.boot_slot_s}: expected at least {team.slot_needs_ns * 1e-9:.9f} s, "
               "what the frames of one slot need with their guard times")
    elif team.topology == "discovered" and team.sure:
        yield from _late_problems(team, scenario, medium, plans)
    if team.sure:
        added = _delays(team, scenario, plans, graphs)
        late_ns = own_late_ns(team, medium.name, graphs.values(), added)
        if team.hold is Hold.VALUE:
            yield from late_values(msgspec.structs.replace(team, own_late_ns=late_ns), medium.name, judged, added)
        yield from late_for_models(team, added)
    yield from _medium_problems(team, scenario, medium, plans, graphs)
    offsets_ns = [agent.clock.offset_ns for agent in scenario.agents.values()]
    if max(offsets_ns) - min(offsets_ns) > round(team.guard_s * 1e9):
        yield (f"agents: clocks are up to {max(offsets_ns) - min(offsets_ns)} ns apart at the start: expected at most "
               f"the guard time, team.guard_s={team.guard_s}, or the first slots overlap")


def prepare(scenario: ScenarioView, own: Own[Any]) -> dict[str, Any]:
    """Return additions to the team table: frame times, and the round plan of each graph that will occur."""
    team = read_team(scenario.team)
    medium = scenario.media[next(iter(scenario.agents.values())).media[0]]
    team = msgspec.structs.replace(team, layout=frame_layout(team, medium))
    plans = RoundPlans(team)
    graphs = occurring_graphs(team, scenario, medium)
    added = _delays(team, scenario, plans, graphs)
    late_ns = own_late_ns(team, medium.name, graphs.values(), added)
    team = msgspec.structs.replace(team, own_late_ns=late_ns)
    entries = [msgspec.structs.replace(entry, assumed_ns=assumed_ns(team, medium.name, plan, added))
               for graph in graphs.values() if (entry := plans.table_entry(graph)) and (plan := plans.plan(graph))]
    slowest = max((_contraction(team, plan, team.layout) for graph in graphs.values()
                   if (plan := plans.plan(graph)) is not None), default=0.0) if team.resynchronize else 0.0
    return {"layout": msgspec.to_builtins(team.layout),
            "designs": [msgspec.to_builtins(entry) for entry in entries],
            "sync_contraction": slowest,
            "own_late_ns": late_ns,
            "oldest_value_ns": oldest_value_ns(team, medium.name, graphs, added)}


def _delays(team: Team, scenario: ScenarioView, plans: RoundPlans,
            graphs: Mapping[str, Floats]) -> dict[LinkName, AddedDelay]:
    """Return the delays that impairments add to the frames of a robot, which sends at most once in a slot."""
    slots_ns = [plan.slot_ns for graph in graphs.values() if (plan := plans.plan(graph)) is not None]
    sizes_bytes = [SyncFrameCodec(len(team.names), team.values_per_frame).size_bytes]
    if team.topology == "discovered":
        slots_ns.append(plans.boot().slot_ns)
        sizes_bytes.append(frame_bytes(len(team.names)))
    flow = Flow(tuple(sizes_bytes), max(1, min(slots_ns, default=1)))
    return added_delays(scenario.impairments, flow, scenario.length_ns)


def frame_layout(team: Team, medium: MediumView) -> Layout:
    radio = medium.settings.radio()
    data_ns = radio.airtime_ns(SyncFrameCodec(len(team.names), team.values_per_frame).size_bytes)
    control_ns = radio.airtime_ns(frame_bytes(len(team.names))) if team.topology == "discovered" else 0
    return Layout(data_ns, control_ns, radio.receive_latency_ns)


def occurring_graphs(team: Team, scenario: ScenarioView, medium: MediumView) -> dict[str, Floats]:
    """Return the Laplacians that the robots will work with, by a name for the sentences of `check`.

    The result is empty if the robots discover a topology that moves, as its graphs are not known before the run.
    """
    if team.topology == "told":
        return {f"team.requests[{index}]": team.laplacian_of(request.links)
                for index, request in enumerate(team.requests)}
    topology = topology_of(scenario, medium)
    if topology.moves:
        return {}
    found: dict[str, Floats] = {}
    for at_ns in [0, *topology.changes_ns(scenario.length_ns)]:
        graph = _laplacian_at(team, topology, at_ns)
        if not any(np.array_equal(graph, known) for known in found.values()):
            found[f"the graph from {at_ns * 1e-9:g} s"] = graph
    return found


def _clock_problems(team: Team, plan: RoundPlan, layout: Layout) -> Iterator[str]:
    contraction = _contraction(team, plan, layout)
    if contraction >= 1:
        yield (f"team.resynchronize: the clocks do not settle: their differences change by a factor of "
               f"{contraction:.4g} per round, expected below 1; let every robot hear at least one other")


def _contraction(team: Team, plan: RoundPlan, layout: Layout) -> float:
    """Return the factor by which the differences of the clocks shrink per round."""
    heard = heard_by(plan.laplacian)
    part_of = {number: index for index, part in enumerate(plan.parts) for number in part}
    return contraction_per_round(
        {name: [team.names[j] for j in heard[i]] for i, name in enumerate(team.names)},
        {name: part_of[i] for i, name in enumerate(team.names)}, SYNC_GAIN, own_slot=True,
        airtime_share=min(1.0, layout.data_airtime_ns / plan.slot_ns))


def _late_problems(team: Team, scenario: ScenarioView, medium: MediumView, plans: RoundPlans) -> Iterator[str]:
    """Yield the links too slow for the slots of the start, in which discovery begins and to which robots fall back."""
    name = next(iter(scenario.agents.values())).media[0]
    topology = topology_of(scenario, medium)
    links = {(name, *edge) for at_ns in [0, *topology.changes_ns(scenario.length_ns)]
             for edge in topology.graph_at(at_ns)}
    clocks = {node: agent.clock for node, agent in scenario.agents.items()}
    yield from late_control_frames(team, plans.boot().slot_ns, scenario.impairments, links, clocks, scenario.length_ns)


def _medium_problems(team: Team, scenario: ScenarioView, medium: MediumView, plans: RoundPlans,
                     graphs: Mapping[str, Floats]) -> Iterator[str]:
    settings, radio = medium.settings, medium.settings.radio()
    if settings.mac_defers:
        yield f'media: mac="{settings.mac}": expected "none", a slot decides who may speak'
    sizes = {"sync": SyncFrameCodec(len(team.names), team.values_per_frame).size_bytes}
    if team.topology == "discovered":
        sizes["discovery"] = frame_bytes(len(team.names))
    for kind, size in sizes.items():
        if radio.max_payload_bytes is not None and size > radio.max_payload_bytes:
            yield (f"media: max_payload_bytes={radio.max_payload_bytes}: a {kind} frame of {len(team.names)} robots "
                   f"has {size} bytes")
    if team.topology == "told":
        yield from _told_problems(team, scenario, medium, plans, graphs)


def _told_problems(team: Team, scenario: ScenarioView, medium: MediumView, plans: RoundPlans,
                   graphs: Mapping[str, Floats]) -> Iterator[str]:
    """Yield the requested links that a radio with a constant graph lacks, and the robots whose frames collide on it."""
    topology = topology_of(scenario, medium)
    if topology.moves or topology.changes_ns(scenario.length_ns):
        return
    heard = _laplacian_at(team, topology, 0)
    for name, graph in graphs.items():
        missing = [(team.names[i], team.names[j]) for i, j in np.argwhere((graph < 0) & (heard == 0))]
        if missing:
            yield f"{name}: {missing[0][0]} is to use what {missing[0][1]} broadcasts, but the radio has no such link"
        plan = plans.plan(graph)
        if plan is not None and medium.settings.decoding().overlap_loses_both and team.layout.data_airtime_ns:
            for i, j in colliding_pairs(heard, plan.parts)[:1]:
                yield (f"{name}: {team.names[i]} and {team.names[j]} share a slot, but on this radio their frames "
                       "collide: more robots are in range than the topology asked for has links")


def _laplacian_at(team: Team, topology: Topology, at_ns: int) -> Floats:
    number = {name: index for index, name in enumerate(team.names)}
    return laplacian(len(number), [(number[sender], number[receiver]) for sender, receiver in topology.graph_at(at_ns)])

"""Checks a scenario of robots that agree by waves before its run, and prepares the team's table.

`check` yields the reasons why a run cannot converge, with the rule and the number:

- with waves, each agent is passive (`passivity.py`), and a line gives no energy: its waves are 0 when no frame comes,
  or each is used after the same delay and none is lost;
- the graph is connected, each line is on the radio, and a slot holds its frame;
- with constant delays, the spectral radius of the exact map of a round is below 1.

Not modelled: graphs that change, an impairment of the scenario's author.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from agents.radio_topology import NoSharedRadio, shared_radio, topology_of
from agents.synchronization.graph import Edge, distances, laplacian
from agents.synchronization.late_values import AddedDelay, added_delays, constructed
from agents.synchronization.team import TeamError
from agents.waves.jump_loop import JumpLoop
from agents.waves.network import Network
from agents.waves.output_loop import OutputLoop, own_delay_ns
from agents.waves.passivity import violation
from agents.waves.team import WaveTeam, read_wave_team
from agents.waves.wave_loop import wave_loop
from firmware_sim.scenario_view import MediumView, Own, ScenarioView
from netem.core.link_name import LinkName
from netem.impairments import Impairment
from netem.impairments.flow import Flow
from netem.wire.instants import in_ms

MOST_COMPONENTS = 600       # of the state of a loop whose map is computed: about three seconds
ALL_THE_SAME = "or set team.sure = false to run it all the same"


def check(scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
    """Yield every reason why these robots do not agree, or why it is not known that they do."""
    try:
        team = read_wave_team(scenario.team)
        medium = shared_radio(scenario, team.names, "slots and lines are those of all robots")
    except TeamError as error:
        yield from error.problems
        return
    except NoSharedRadio as error:
        yield str(error)
        return
    problems = [*_graph_problems(team), *_radio_problems(team, scenario, medium)]
    if team.waves:
        problems += _passivity_problems(team)
    yield from problems
    if not problems and team.sure:
        yield from _delay_problems(team, scenario, medium)


def prepare(scenario: ScenarioView, own: Own[Any]) -> dict[str, Any]:
    """Return the delay of each robot's own value, that of the latest of its neighbours' values."""
    team = read_wave_team(scenario.team)
    medium = scenario.media[next(iter(scenario.agents.values())).media[0]]
    network = _network(team, medium, _added(team, scenario, medium))
    return {"own_late_ns": [own_delay_ns(network, i, True) if heard else 0
                            for i, heard in enumerate(team.neighbours)]}


def _graph_problems(team: WaveTeam) -> Iterator[str]:
    apart = np.argwhere(np.isinf(distances(laplacian(len(team.names), team.edges))))
    if apart.size:
        one, other = (team.names[k] for k in apart[0])
        yield f"team.links: no path leads from {one} to {other}: they cannot agree; add a link"


def _passivity_problems(team: WaveTeam) -> Iterator[str]:
    for name, agent, heard in zip(team.names, team.agents, team.neighbours, strict=True):
        found = violation(agent, team.port.impedance)
        if found is not None:
            taken = team.port.own_damping * len(heard)
            yield (f"team.models.{name}: the agent behind its {len(heard)} ports, A + {taken:g} B C, is not passive: "
                   f"{found}; waves make delays harmless between passive agents only: add damping to the plant, "
                   "take another output, or correct A if it lacks the dampers of the ports")


def _radio_problems(team: WaveTeam, scenario: ScenarioView, medium: MediumView) -> Iterator[str]:
    settings, radio = medium.settings, medium.settings.radio()
    if settings.mac_defers:
        yield f'media.{medium.name}.mac="{settings.mac}": expected "none", a slot decides who may send'
    longest = max(team.codec.size_bytes(i) for i in range(len(team.names)))
    if radio.max_payload_bytes is not None and longest > radio.max_payload_bytes:
        yield (f"media.{medium.name}.max_payload_bytes={radio.max_payload_bytes}: a frame with a wave for each "
               f"neighbour has up to {longest} bytes")
    needed_ns = radio.airtime_ns(longest) + 2 * team.guard_ns
    if team.slot_ns < needed_ns:
        yield (f"team.slot_s={team.slot_s}: shorter than a frame of {longest} bytes with its guard times, {needed_ns} "
               f"ns; take at least {needed_ns * 1e-9:.9f}")
    offsets_ns = [agent.clock.offset_ns for agent in scenario.agents.values()]
    if max(offsets_ns) - min(offsets_ns) > 2 * team.guard_ns:
        yield (f"agents: clocks are up to {in_ms(max(offsets_ns) - min(offsets_ns))} apart at the start: expected "
               f"at most two guard times, team.guard_s={team.guard_s}, or frames overlap")
    topology = topology_of(scenario, medium)
    if topology.moves or topology.changes_ns(scenario.length_ns):
        return
    there = set(topology.graph_at(0))
    for sender, receiver in team.edges:
        if (team.names[sender], team.names[receiver]) not in there:
            yield (f"team.links: {team.names[receiver]} is to use what {team.names[sender]} sends, but media."
                   f"{medium.name} has no such link")


def _delay_problems(team: WaveTeam, scenario: ScenarioView, medium: MediumView) -> Iterator[str]:
    added = _added(team, scenario, medium)
    if team.use_after_ns:
        yield from _late_lines(team, medium, added)
    places = _varying(team, scenario, medium, added)
    if places:
        if not team.waves:
            yield (f"{' and '.join(places)}: the delay varies or frames are lost: nothing proves that outputs that are "
                   f'held agree; take team.coupling = "waves", {ALL_THE_SAME}')
        elif team.when_silent == "hold":
            yield (f"{' and '.join(places)}: the delay varies or frames are lost, and a wave is held until the next "
                   "one comes: a line then gives more energy than it gets, and nothing proves that the robots agree; "
                   f'take team.when_silent = "zero", or a team.use_after_s longer than each delay, {ALL_THE_SAME}')
        return
    network = _network(team, medium, added)
    longest_ns = network.longest_ns
    if (loop := _loop(team, network)) is None:
        if team.waves:
            return              # passivity is enough
        yield (f"the exact map of a round has more than {MOST_COMPONENTS} rows with delays of up to {in_ms(longest_ns)}"
               f", for which it is not computed; shorten the delays, {ALL_THE_SAME}")
    elif loop.radius >= 1:
        late = (f" and delays of up to {in_ms(longest_ns)}" if team.waves else
                f", delays of up to {in_ms(longest_ns)} and own values used {team.own_value}")
        yield (f"slots of {in_ms(team.slot_ns)}{late} make the loop unstable: the exact map of a round has the "
               f"spectral radius {loop.radius:.7g}, expected below 1; "
               f"{_longest_stable(team, network)}; shorten the delays"
               f"{'' if team.waves else ', take waves'}, {ALL_THE_SAME}")


def _late_lines(team: WaveTeam, medium: MediumView, added: Mapping[LinkName, AddedDelay]) -> Iterator[str]:
    """Yield the first line on which no frame comes before its wave is due."""
    for (sender, receiver), most_ns in _network(team, medium, added, as_used=False).delays_ns.items():
        link = team.names[sender], team.names[receiver]
        delay = added.get((medium.name, *link), AddedDelay())
        least_ns = most_ns - delay.most_ns + delay.least_ns
        if least_ns > team.use_after_ns:
            yield (f"team.use_after_s={team.use_after_s}: a frame from {link[0]} to {link[1]} takes {in_ms(least_ns)} "
                   "or more, so that each of its waves comes after it is due; take more")
            return


def _varying(team: WaveTeam, scenario: ScenarioView, medium: MediumView,
             added: Mapping[LinkName, AddedDelay]) -> list[str]:
    """Return the places of the impairments by which a link does more than use each value after the same delay."""
    lines = {(medium.name, team.names[sender], team.names[receiver]) for sender, receiver in team.edges}
    in_time = _network(team, medium, added, as_used=False).longest_ns <= team.use_after_ns
    flow, found = _flow(team), []
    for spec, impairment in constructed(scenario.impairments):
        if not lines & set(spec.links):
            continue
        harmless = impairment is not None and impairment.only_delays and (
            in_time if team.use_after_ns else not spec.windows_ns and _is_constant(impairment, flow))
        if not harmless:
            found.append(spec.place)
    return found


def _loop(team: WaveTeam, network: Network) -> JumpLoop | None:
    """Return the exact loop; None if its state is too large."""
    values = sum(delay_ns // network.round_ns + 2 for delay_ns in network.delays_ns.values())
    if values + network.all_states > MOST_COMPONENTS:
        return None
    return (wave_loop(network, team.port) if team.waves else
            OutputLoop(network, team.damping, team.own_value == "late").loop)


def _longest_stable(team: WaveTeam, network: Network) -> str:
    """Return in words up to which delay the loop is stable, found by steps of a slot and bisection."""
    def is_stable(most_ns: int) -> bool:
        loop = _loop(team, network.at_most(most_ns))
        return loop is not None and loop.radius < 1

    if not is_stable(0):
        return "it is unstable without delays too; use shorter slots or less damping"
    stable_ns, unstable_ns = 0, network.slot_ns
    while unstable_ns < network.longest_ns and is_stable(unstable_ns):
        stable_ns, unstable_ns = unstable_ns, unstable_ns + network.slot_ns
    unstable_ns = min(unstable_ns, network.longest_ns)
    while unstable_ns - stable_ns > 1:
        middle_ns = (stable_ns + unstable_ns) // 2
        stable_ns, unstable_ns = (middle_ns, unstable_ns) if is_stable(middle_ns) else (stable_ns, middle_ns)
    return f"it is stable up to {in_ms(stable_ns)}, {stable_ns / network.slot_ns:.4g} slots"


def _added(team: WaveTeam, scenario: ScenarioView, medium: MediumView) -> dict[LinkName, AddedDelay]:
    return added_delays(scenario.impairments, _flow(team), scenario.length_ns)


def _flow(team: WaveTeam) -> Flow:
    return Flow(tuple(sorted({team.codec.size_bytes(i) for i in range(len(team.names))})), team.slot_ns)


def _is_constant(impairment: Impairment, flow: Flow) -> bool:
    return all(impairment.least_delay_ns(size) == impairment.most_delay_ns(flow) for size in flow.sizes_bytes)


def _network(team: WaveTeam, medium: MediumView, added: Mapping[LinkName, AddedDelay], *,
             as_used: bool = True) -> Network:
    """Return the network with the delay of each link, at its greatest value; `as_used`: with `use_after_s` that one."""
    radio = medium.settings.radio()
    delays_ns: dict[Edge, int] = {}
    for sender, receiver in team.edges:
        late = added.get((medium.name, team.names[sender], team.names[receiver]), AddedDelay())
        airtime_ns = radio.airtime_ns(team.codec.size_bytes(sender))
        delays_ns[sender, receiver] = airtime_ns + radio.receive_latency_ns + late.most_ns
    network = Network(tuple(team.agents), delays_ns, team.slot_ns)
    return network.with_delay(team.use_after_ns) if team.use_after_ns and as_used else network

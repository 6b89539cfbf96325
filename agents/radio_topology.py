"""The one radio that a team shares, and who hears whom on it, for checks before a run."""

from __future__ import annotations

from collections.abc import Sequence

from firmware_sim.scenario_view import MediumView, ScenarioView
from netem.core.random_streams import stream
from netem.topology import Site, Topology


class NoSharedRadio(ValueError):
    """The robots of a scenario are not those of its team table, or are not all on one radio."""


def shared_radio(scenario: ScenarioView, names: Sequence[str], why: str) -> MediumView:
    """Return the radio on which all robots are; `names` are those of the team table, `why` says what needs all of them.

    Raises NoSharedRadio with place, value and rule."""
    if sorted(names) != sorted(scenario.agents):
        raise NoSharedRadio(f"team.models: {list(names)}: expected exactly the agents of the scenario, "
                            f"{sorted(scenario.agents)}: {why}")
    media = {medium for agent in scenario.agents.values() for medium in agent.media}
    if len(media) != 1 or any(len(agent.media) != 1 for agent in scenario.agents.values()):
        raise NoSharedRadio(f"media: {sorted(media)}: expected all robots on one and the same medium")
    medium = scenario.media[media.pop()]
    if medium.settings.radio() is None:
        raise NoSharedRadio(f"media.{medium.name}: robots that share slots need a broadcast_radio")
    return medium


def topology_of(scenario: ScenarioView, medium: MediumView) -> Topology:
    """Return the topology of a medium of kind broadcast_radio, with the streams and places of a run."""
    positions = {node: at for node in medium.nodes
                 if node in scenario.agents and (at := scenario.agents[node].at_m) is not None}
    radio = medium.settings.radio()
    topology: Topology = medium.settings.topology.over(
        Site(medium.nodes, positions, radio.tx_power_dbm, radio.sensitivity_dbm,
             lambda place: stream(scenario.seed, f"media.{medium.name}.{place}")))
    return topology

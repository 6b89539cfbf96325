"""Who hears whom on a radio of a scenario, for checks before a run."""

from __future__ import annotations

from firmware_sim.scenario_view import MediumView, ScenarioView
from netem.core.random_streams import stream
from netem.topology import Site, Topology


def topology_of(scenario: ScenarioView, medium: MediumView) -> Topology:
    """Return the topology of a medium of kind broadcast_radio, with the streams and places of a run."""
    positions = {node: at for node in medium.nodes
                 if node in scenario.agents and (at := scenario.agents[node].at_m) is not None}
    radio = medium.settings.radio()
    topology: Topology = medium.settings.topology.over(
        Site(medium.nodes, positions, radio.tx_power_dbm, radio.sensitivity_dbm,
             lambda place: stream(scenario.seed, f"media.{medium.name}.{place}")))
    return topology

"""Makes the specifications of a scenario's nodes, from which their processes build them."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.programs.firmware_programs import class_for
from experiments.run.node_build import NodeSpecification, PlantSpecification, Shown
from experiments.scenario.blocking_programs import is_blocking
from experiments.scenario.model import AgentSpec, Scenario
from experiments.scenario.socket_addresses import interfaces_of
from experiments.scenario.zenoh_ways import specification as zenoh_of
from firmware_sim.program_settings import build_settings
from firmware_sim.scenario_view import OwnAgent, Preparing, unseen
from fmus.build import build_model, model_folder, own_models
from fmus.describe import Model, read_model
from fmus.describe_fmu import describe
from fmus.description import PlantDescription


def node_specifications(scenario: Scenario, progress: Preparing = unseen) -> dict[str, NodeSpecification]:
    """Return a specification for each agent; the results of the programs' `prepare` are added to the table [team].

    `progress` is called by those of them that take it.
    """
    team: dict[str, Any] = dict(scenario.team)
    blocking, handling_events = set(), set()
    for path in sorted({agent.program for agent in scenario.agents.values()}):
        program = class_for(path, scenario.folder)
        if is_blocking(program):
            blocking.add(path)
            continue
        if getattr(program, "handles_events", False):
            handling_events.add(path)
        if (prepare := getattr(program, "prepare", None)) is not None:
            more = {"progress": progress} if "progress" in inspect.signature(prepare).parameters else {}
            team.update(prepare(scenario, own_agents(scenario, path, program), **more))
    folder = str(scenario.folder)
    mortal = {node for fault in scenario.faults if fault.settings.kills for node, *_ in fault.targets}
    fmus = {agent.plant.fmu for agent in scenario.agents.values() if agent.plant is not None}
    described = {fmu: describe(build_model(fmu) if fmu in own_models() else Path(fmu)) for fmu in sorted(fmus)}
    models = {fmu: read_model(model_folder(fmu) / "variables.toml") for fmu in sorted(fmus & set(own_models()))}
    return {name: NodeSpecification(name, agent.program, agent.parameters, agent.media, agent.clock,
                                    _plant(agent, described, models), team, scenario.sample_period_ns, scenario.seed,
                                    folder, agent.program in blocking, _own_frames(scenario, agent),
                                    _notified(scenario, agent), _can_buses(scenario, agent), _shown(scenario, agent),
                                    agent.name in mortal, agent.program in handling_events,
                                    zenoh_of(scenario, agent) if agent.program in blocking else None,
                                    interfaces_of(scenario, agent), _byte_streams(scenario, agent))
            for name, agent in scenario.agents.items()}


def own_agents(scenario: Scenario, path: str, program: type) -> dict[str, OwnAgent[Any]]:
    """Return the agents with the program at `path`, as the methods of its class get them."""
    return {name: OwnAgent(name, build_settings(program, agent.parameters), agent)
            for name, agent in scenario.agents.items() if agent.program == path}


def _own_frames(scenario: Scenario, agent: AgentSpec) -> tuple[str, ...]:
    return tuple(medium for medium in agent.media
                 if scenario.media[medium].settings.reports_own_frames_to(agent.name))


def _notified(scenario: Scenario, agent: AgentSpec) -> bool:
    return any(scenario.media[medium].settings.notifies(agent.name) for medium in agent.media)


def _can_buses(scenario: Scenario, agent: AgentSpec) -> tuple[str, ...]:
    return tuple(medium for medium in agent.media if scenario.media[medium].settings.carries_can_frames)


def _byte_streams(scenario: Scenario, agent: AgentSpec) -> tuple[str, ...]:
    return tuple(medium for medium in agent.media if scenario.media[medium].settings.serial_format() is not None)


def _shown(scenario: Scenario, agent: AgentSpec) -> tuple[Shown, ...]:
    return tuple(Shown(medium, pose.period_ns, pose.outputs) for medium in agent.media
                 if (pose := scenario.media[medium].settings.poses().get(agent.name)) is not None)


def _plant(agent: AgentSpec, described: Mapping[str, PlantDescription],
           models: Mapping[str, Model]) -> PlantSpecification | None:
    if agent.plant is None:
        return None
    fmu, plant = agent.plant.fmu, described[agent.plant.fmu]
    parameters, step_ns = agent.plant.parameters, agent.plant.step_ns
    idle = models[fmu].idle_outputs(parameters) if fmu in models else []
    return PlantSpecification(plant, parameters, step_ns, idle)

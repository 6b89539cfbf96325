"""Checks of the plant that a mover moves, and of the way to it, before a run: each problem with its remedy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from agents.marco_polo_game.movers import Platform
from firmware_sim.scenario_view import ScenarioView

if TYPE_CHECKING:
    from fmus.description import Variable


class Remote(NamedTuple):
    """How a mover reaches a plant that another agent has; the words of its refusals."""

    key: str                    # parameter of the sensor: "drive"
    moves: str                  # verb: "drives"
    port_key: str               # key within that parameter: "can"
    port: str                   # its value
    medium: str                 # kind of the medium at that port
    controller: str             # agent that has the plant: "drive controller"
    vehicle: str                # "platform"


def remote_problems(scenario: ScenarioView, platform: Platform, remote: Remote) -> Iterator[str]:
    """Yield what keeps a mover from reaching the plant that carries the sensor's camera, but for its plant."""
    name, agent = platform.sensor, platform.agent
    key, moves, port_key, port, medium, controller, vehicle = remote
    if platform.barriers:
        yield (f"agents.{name}.parameters.{key}: its platform cuts corners and brakes, and does not keep clear of "
               "team.obstacles and team.zones; leave them out, or give it an omnidirectional plant")
    if agent.plant is not None:
        yield (f"agents.{name}.plant: this sensor has a plant and {moves} another one over {port}; give it the plant "
               f"or the parameter {key}")
    if port not in agent.media:
        yield (f"agents.{name}.parameters.{key}.{port_key}={port!r}: no such port; it is on {', '.join(agent.media)}; "
               f"add a medium of kind {medium}, with this sensor and its {controller}")
        return
    carrier = carrier_of(scenario, platform, port)
    if carrier is None:
        yield (f"media.{platform.view}.cameras: the camera of {name} is on {platform.carrier or 'no body'}; it rides "
               f"on the {vehicle} that {name} {moves}: write {name} = the {controller} on {port}")


def carrier_of(scenario: ScenarioView, platform: Platform, port: str) -> str | None:
    """Return the agent that carries the camera, if it is not the sensor and both are on the medium `port`."""
    carrier = platform.carrier if port in platform.agent.media else None
    found = None if carrier is None else scenario.agents.get(carrier)
    return carrier if found is not None and carrier != platform.sensor and port in found.media else None


def plant_problems(agent: str, plant: Any, inputs: Sequence[str], model: str) -> Iterator[str]:
    """Yield a problem if the plant of an agent is an own model that lacks one of `inputs`; `model` has them all."""
    known = _variables(plant)
    if known and (lacking := [name for name in inputs if name not in known]):
        yield (f"agents.{agent}.plant.fmu={plant.fmu!r}: has no {', '.join(lacking)}, by which this platform is moved; "
               f"take {model!r}")


def told_otherwise(agent: str, plant: Any, told: Mapping[str, float], where: str) -> Iterator[str]:
    """Yield a problem for each parameter of a plant that differs from what the program is told at `where`."""
    starts = _variables(plant)
    for name, value in told.items():
        start = starts[name].start if name in starts else None
        known = plant.parameters.get(name, value if start is None else float(start))
        if known != value:
            yield f"{where}: {name}={value:g}, and agents.{agent}.plant has {name}={known:g}; write the same in both"


def _variables(plant: Any) -> Mapping[str, Variable]:
    """Return the variables of an own model; of a plant by a path, which is read at the start of the run, none."""
    from fmus.build import model_folder, own_models  # late: a robot's process needs no tables of models
    from fmus.describe import read_model, variables_of

    if plant.fmu not in own_models():
        return {}
    return variables_of(read_model(model_folder(plant.fmu) / "variables.toml"))

"""What a mover needs of a plant, looked for in the scenario before a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fmus.description import Variable


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

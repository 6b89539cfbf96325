"""A parameter of a node's plant changes at an instant, as with a motor that weakens or a load that is picked up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

from netem.faults import Target, World
from netem.faults.candidates import Between
from netem.faults.plant_change import PlantChange
from netem.faults.schedule import Occurrence


@dataclass(frozen=True)
class PlantParameter(PlantChange):
    """Sets a tunable parameter, or an input until the program sets it anew."""

    lasting: ClassVar = False
    needs: ClassVar = "a plant with a tunable parameter of a real type"
    drawn: ClassVar = Between(0.5, 1.5)

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for node, in targets:
            world.at(occurrence.start_ns, partial(world.in_node, node, "plant_parameter", self.fields()))

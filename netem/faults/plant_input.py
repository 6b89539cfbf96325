"""An input of a node's plant does not get what the program sets, as with an actuator that is stuck or weak."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

from netem.faults import Target, World
from netem.faults.candidates import Between
from netem.faults.plant_change import PlantChange
from netem.faults.schedule import Occurrence
from netem.wire.instants import NEVER_NS


@dataclass(frozen=True)
class PlantInput(PlantChange):
    """At the end the value that was set last acts again."""

    inputs_only: ClassVar = True
    needs: ClassVar = "a plant with an input of a real type"
    drawn: ClassVar = Between(0.0, 1.0)             # an actuator that is weak

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for node, in targets:
            for time_ns, begins in ((occurrence.start_ns, True), (occurrence.end_ns, False)):
                if time_ns < NEVER_NS:
                    world.at(time_ns, partial(world.in_node, node, "plant_input", {**self.fields(), "begins": begins}))

"""A sensor is blind: it detects nothing on the links that the fault names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from netem.faults import Fault, Target, World
from netem.faults.schedule import Occurrence


@dataclass(frozen=True)
class SensorFault(Fault):
    """A fault of a sensing medium, which then is `how`, on links from a body to an observer."""

    on: ClassVar = "links"
    strikes: ClassVar = "sensor"
    needs: ClassVar = "a sensing medium, and a body that is seen"
    how: ClassVar[str]

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for target in targets:
            world.on_medium(target, self.how, cause, self.fields(), occurrence)

    def fields(self) -> Mapping[str, Any]:
        return {}


@dataclass(frozen=True)
class Blackout(SensorFault):
    how: ClassVar = "blind"

"""A node is killed: its process ends by SIGKILL, in the middle of whatever it does; its plant goes on without it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar, Literal

from netem.faults import Fault, Site, Target, World
from netem.faults.candidates import Candidate, ShareOfLength
from netem.faults.schedule import Occurrence
from netem.wire.instants import NEVER_NS


@dataclass(frozen=True)
class Kill(Fault):
    """The program starts anew `restart_after_ns` later; None: never.

    `clock` says what the robot's clock reads then: "kept", it runs on, as that of a computer whose process was
    restarted; "reset", it reads its offset, as a counter that starts with the processor. While the robot is dead the
    inputs of its plant stay as they are, or are set to `inputs_when_dead`.
    """

    lasting: ClassVar = False
    kills: ClassVar = True
    away: ClassVar = True
    unset: ClassVar[Mapping[str, str]] = {"restart_after_ns": "never"}
    restart_after_ns: int | None = None
    clock: Literal["kept", "reset"] = "kept"
    inputs_when_dead: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.restart_after_ns is not None and self.restart_after_ns < 1:
            raise ValueError(f"restart_after_ns={self.restart_after_ns}: expected more than 0: a node restarts after "
                             "it was killed")

    @classmethod
    def candidates(cls, site: Site) -> list[Candidate]:
        return [Candidate(on, {"restart_after_ns": ShareOfLength(1 / 4)}) for on in cls.targets(site)]

    def refusal(self, target: Target, site: Site) -> str:
        node, = target
        for name, value in self.inputs_when_dead.items():
            why = f"{node} has no plant" if node not in site.plants else site.plants[node].refusal_of_change(
                name, inputs_only=True, scaled=False, value=value)
            if why:
                return f"inputs_when_dead={{{name} = {value}}}: {why}"
        return ""

    def until_ns(self, occurrence: Occurrence) -> int:
        return NEVER_NS if self.restart_after_ns is None else occurrence.start_ns + self.restart_after_ns

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        fields = {"clock": self.clock, "inputs_when_dead": dict(self.inputs_when_dead)}
        for node, in targets:
            world.at(occurrence.start_ns, partial(world.kill, node, self.until_ns(occurrence), fields, cause))

"""Links are cut: no frame copy passes that enters them or would arrive within the window.

    carriers = "cross"      a radio across the cut still senses frames of the other side, and loses what they overlap
    carriers = "stop"       nothing of a frame that starts within the window crosses: no carrier, no interference
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from typing import Any, ClassVar, Final, Literal

from netem.faults import Fault, Site, Target, World
from netem.faults.schedule import Occurrence

CARRIERS: Final = "carriers"            # the part of a medium whose carriers can be stopped


@dataclass(frozen=True)
class LinkDown(Fault):
    """`spares_under_way` lets copies pass that have entered the link before: so do faults that were injected.

    `carriers` is for media with carriers only, where None has the meaning of "cross".
    """

    on: ClassVar = "links"
    cuts: ClassVar = True
    spares_under_way: bool = False
    carriers: Literal["cross", "stop"] | None = None

    @classmethod
    def draw(cls, rng: Random, length_ns: int) -> dict[str, Any]:
        return {}

    def refusal(self, target: Target, site: Site) -> str:
        if self.carriers is None or CARRIERS in site.strikable.get(target[0], ()):
            return ""
        return (f'carriers="{self.carriers}": {target[0]!r} is a medium without carriers, which others could sense or '
                "lose frames by: leave the key out")

    def acts_again(self) -> bool:
        return self.carriers == "stop"

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for medium, sender, receiver in targets:
            world.cut((medium, sender, receiver), cause, self.spares_under_way).add(*occurrence)
            if self.carriers == "stop":
                world.on_medium((medium, sender, receiver), "carrier stopped", cause, {}, occurrence)

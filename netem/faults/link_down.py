"""Links are cut: no frame copy passes that enters them or would arrive within the window.

    carriers = "cross"      a radio across the cut still senses frames of the other side, and loses what they overlap
    carriers = "stop"       nothing of a frame that starts within the window crosses: no carrier, no interference
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final, Literal

from netem.faults import Fault, Site, Target, World
from netem.faults.candidates import Candidate, OneOf, Range
from netem.faults.schedule import Occurrence

CARRIERS: Final = "carriers"            # the part of a medium whose carriers can be stopped


@dataclass(frozen=True)
class LinkDown(Fault):
    """`spares_under_way` lets copies pass that their medium has passed to the link before the window.

    An injected fault has this key, since what becomes of those copies was decided before it was known.

    `carriers` is for media with carriers only, where None has the meaning of "cross".
    """

    on: ClassVar = "links"
    needs: ClassVar = "a medium with two nodes or more"
    cuts: ClassVar = True
    spares_under_way: bool = False
    unset: ClassVar[Mapping[str, str]] = {"carriers": "cross"}
    carriers: Literal["cross", "stop"] | None = None

    @classmethod
    def candidates(cls, site: Site) -> list[Candidate]:
        return [Candidate(on, cls.carriers_on(on, site)) for on in cls.targets(site)]

    @staticmethod
    def carriers_on(on: str, site: Site) -> dict[str, Range]:
        """Return the range of `carriers` for a medium, or for a link of it, that has any."""
        medium = on.partition(":")[0]
        return {"carriers": OneOf(("cross", "stop"))} if CARRIERS in site.strikable.get(medium, ()) else {}

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

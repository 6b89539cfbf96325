"""Guides a pursuit by the track line (capturing policy of section 2.2.2).

    out of view    by cells to the first place of the track line that the UGV reaches before the target, or to the exit
    in view        straight to that place, if the way there is clear

It plans anew every `update_ns`, and at each sight and detection. It gives up when the UGV is where the target was
expected to leave the area, and that time has passed.
"""

from __future__ import annotations

from math import dist

from agents.marco_polo_game.guidance import Deck, Deployment, Guidance, Plan
from agents.marco_polo_game.track import Seen, Track
from agents.pursuit import Place


class PlainPursuit(Guidance):
    lost = "the target is not where it was expected to leave"

    def __init__(self, deck: Deck) -> None:
        self._deck = deck
        self._speed_mps = deck.game.speed_mps(deck.board.name)
        self._track: Track | None = None

    @property
    def ends_ns(self) -> int:
        assert self._track is not None
        return self._track.forecast().leaves_ns

    def begin(self, deployment: Deployment, now_ns: int) -> None:
        self._track = deployment.track

    def saw(self, seen: Seen) -> bool:
        return True

    def plan(self, own: Place, now_ns: int) -> Plan | None:
        assert self._track is not None
        parameters, forecast, sight = self._deck.game.parameters, self._track.forecast(), self._track.sight
        again_ns = now_ns + parameters.update_ns
        goal = forecast.intercept(own, self._speed_mps, now_ns)
        if (sight is not None and now_ns - sight.at_ns <= 2 * self._deck.settings.exposure_ns
                and self._deck.ground.clear(own, goal)):
            return Plan([goal], again_ns)
        way = self._deck.ground.way(self._deck.graph(), own, goal)
        if now_ns >= forecast.leaves_ns and (not way or dist(own, way[-1]) <= parameters.cell_m):
            return None
        return Plan(way, again_ns)

    def end(self) -> None:
        self._track = None

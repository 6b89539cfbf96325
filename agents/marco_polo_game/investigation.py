"""Guides an investigation: to the observation cell of the greatest reward, where the sensor stands.

It ends at the latest time at which the target can be in its C-target, as `agents.marco_polo.legs` has it.
Not modelled: the sweep of section 2.1.
"""

from __future__ import annotations

from agents.marco_polo.c_target import CTarget
from agents.marco_polo.legs import longest_stay_s
from agents.marco_polo_game.guidance import Deck, Deployment, Guidance, Plan
from agents.pursuit import Place


class Investigation(Guidance):
    lost = "the target has left its C-target"

    def __init__(self, deck: Deck) -> None:
        self._deck = deck
        self._ends_ns = 0
        self._way: list[Place] = []

    @property
    def ends_ns(self) -> int:
        return self._ends_ns

    def begin(self, deployment: Deployment, now_ns: int) -> None:
        game, parameters, forecast = self._deck.game, self._deck.game.parameters, deployment.track.forecast()
        target = CTarget(forecast.track, game.radius_m[self._deck.board.name], parameters.cone_content)
        stay_s = longest_stay_s(target.depth_m(game.area), parameters.target_least_mps,
                                0.5e-9 * (parameters.turn_least_ns + parameters.turn_greatest_ns))
        self._ends_ns = forecast.seen_ns + round(stay_s * 1e9)
        self._way = [self._deck.cells.centroid(cell) for cell in deployment.offer.route.cells]

    def plan(self, own: Place, now_ns: int) -> Plan | None:
        return None if now_ns >= self._ends_ns else Plan(self._way, self._ends_ns)

    def end(self) -> None:
        self._way = []

"""Guides a pursuit by the Adaptive Filter (section 3.4): looks when its policy says so, drives to the intercept.

    detections     of this UGV and of others, to the circle filter: expected place p(t) of the target
    way            straight to the first p(t) that the UGV reaches no later than the target
    look at F if   the policy of Figure 3.3 says so, and the target can be in view at F; or p(F) is within the capture
                   distance, outside the area, or in an obstacle (section 3.4)
    left S         the reachable set of the target, without what looks have shown to be empty, is empty

Where p is not in the reachable set, the nearest place of the set stands for it: a look in vain has refuted p.

Differs from the dissertation: its policy keeps the target in view, and knows no capture; a UGV that captures has to see
the target, so it looks where it expects to capture. Before the target has come into view the policy would look at each
instant; here only if the target can be in view.
"""

from __future__ import annotations

from math import dist
from typing import ClassVar

from agents.marco_polo_game.guidance import Deck, Deployment, Guidance, Plan
from agents.marco_polo_game.reachable_set import EmptyView, ReachableSet
from agents.marco_polo_game.track import STEP_NS, Seen, Track
from agents.pursuit import Place
from agents.pursuit.pursuer import Pursuer


class AdaptivePursuit(Guidance):
    lost: ClassVar = "left S"

    def __init__(self, deck: Deck) -> None:
        game = deck.game
        self._deck = deck
        self._radius_m, self._speed_mps = game.radius_m[deck.board.name], game.speed_mps(deck.board.name)
        self._v_max_mps = game.parameters.target_greatest_mps
        self._step_ns, self._latency_ns = deck.settings.exposure_ns, deck.settings.exposure_latency_ns
        (west, east), (south, north) = game.area.x_m, game.area.y_m
        self._longest_ns = round(dist((west, south), (east, north)) / self._speed_mps * 1e9)    # drive across the area
        self._begin_nothing()

    def _begin_nothing(self) -> None:
        self._track: Track | None = None
        self._pursuer: Pursuer = self._deck.settings.pursuer(self._deck.game, self._deck.board.name)
        self._reach = ReachableSet(self._deck.game.area, self._v_max_mps)
        self._known_ns: set[int] = set()            # times of the detections that the filter has
        self._newest: Seen | None = None
        self._asked_ns = self._answered_ns = -1     # exposures of the last look, and of its answer

    @property
    def ends_ns(self) -> int:
        now_ns = self._deck.board.now_ns
        return now_ns if self._reach.left(now_ns) else now_ns + self._longest_ns

    def begin(self, deployment: Deployment, now_ns: int) -> None:
        track = self._track = deployment.track
        for seen in sorted({*track.seen.values(), *([track.sight] if track.sight else [])}):
            self._take(seen)

    def end(self) -> None:
        self._begin_nothing()

    # --- detections and looks

    def saw(self, seen: Seen) -> bool:
        return self._take(seen)

    def answered(self, exposed_ns: int) -> None:
        self._answered_ns = exposed_ns

    def _take(self, seen: Seen) -> bool:
        """Give the filter a detection; return whether it is the newest."""
        if seen.at_ns in self._known_ns or seen.at_ns > self._deck.board.now_ns:
            return False
        self._known_ns.add(seen.at_ns)
        self._pursuer.detected(self._deck.board.now_ns, seen.at_ns, seen.place, seen.place)
        if self._newest is not None and seen.at_ns < self._newest.at_ns:
            return False
        self._newest = seen
        self._reach.seen(*seen)
        return True

    def _note_empty_look(self, own: Place, now_ns: int) -> None:
        """If the look is answered and the target was not in view, take that into account."""
        asked_ns = self._asked_ns
        if asked_ns == self._answered_ns and asked_ns not in self._known_ns:
            moved_m = self._speed_mps * (now_ns - asked_ns) * 1e-9
            if moved_m < self._radius_m:
                self._reach.not_seen(EmptyView(asked_ns, own, self._radius_m - moved_m))

    # --- the plan

    def plan(self, own: Place, now_ns: int) -> Plan | None:
        exposure_ns = (now_ns // self._step_ns + 1) * self._step_ns
        decides_ns = exposure_ns + self._step_ns // 2
        self._note_empty_look(own, now_ns)
        if self._reach.left(now_ns):
            return None
        goal = self._intercept(own, now_ns)
        look = exposure_ns > self._asked_ns and self._wants_look(self._ahead(own, goal, exposure_ns - now_ns), now_ns,
                                                                 exposure_ns)
        if look:
            self._asked_ns = exposure_ns
            self._pursuer.asked(exposure_ns)
        return Plan([goal], decides_ns, look)

    def _wants_look(self, own: Place, now_ns: int, exposure_ns: int) -> bool:
        """Return whether to look at the next exposure, from `own`, where the sensor is then."""
        assert self._newest is not None
        game, expected = self._deck.game, self._expected(exposure_ns)
        if dist(own, expected) <= game.parameters.capture_m or game.area.nearest(expected) != expected:
            return True
        way_m = self._v_max_mps * (exposure_ns - self._newest.at_ns) * 1e-9
        if dist(own, self._newest.place) - way_m > self._radius_m:
            return False                            # it cannot be in view
        return self._pursuer.step(now_ns, own).look_ns <= exposure_ns

    def _intercept(self, own: Place, now_ns: int) -> Place:
        """Return the first expected place, to `STEP_NS`, where the sensor is no later than the target.

        The last one within the area, if the target is expected to leave before."""
        area = self._deck.game.area
        for after_ns in range(0, self._longest_ns, STEP_NS):
            place = self._expected(now_ns + after_ns)
            inside = area.nearest(place)
            if inside != place or dist(own, place) <= self._speed_mps * after_ns * 1e-9:
                break
        return self._reach.nearest(inside, now_ns)

    def _expected(self, at_ns: int) -> Place:
        return self._pursuer.estimator.expect(at_ns)

    def _ahead(self, own: Place, goal: Place, after_ns: int) -> Place:
        """Return where the sensor is on its way to `goal` after `after_ns`."""
        way_m = dist(own, goal)
        share = min(1.0, self._speed_mps * after_ns * 1e-9 / way_m) if way_m > 0 else 0.0
        return own[0] + share * (goal[0] - own[0]), own[1] + share * (goal[1] - own[1])

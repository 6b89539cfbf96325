"""Guides a pursuit by the Adaptive Filter (section 3.4): looks when its policy says so, drives to the intercept.

    detections     of this UGV and of others, to the circle filter: expected place p(t) of the target
    way            straight to the first p(t) that the UGV reaches no later than the target; by cells if an obstacle
                   is in the way
    look at F if   the target can be in view at F, and the policy of Figure 3.3 says so, or p(F) is within the capture
                   distance, outside the area, or in an obstacle (section 3.4)
    left S         the reachable set of the target is empty (`reachable_set`); or the latest time at which a target of
                   the least speed is in S has passed, with probability 0.99 (`guidance.longest_stay_ns`)

Where p(t) is not in the reachable set at t, the nearest place of the set stands for it: looks have refuted p. A pursuit
that ends without a capture names the links that failed it (`link_watch`); if none did, the target has just left S.

Differs from the dissertation: its policy keeps the target in view, and knows no capture; a UGV that captures has to see
the target, so it looks where it expects to capture. Before the target has come into view the policy would look at each
instant; here only if the target can be in view.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import dist
from typing import Final

from agents.bidding.bid_timing import BidTiming
from agents.marco_polo.c_target import CTarget
from agents.marco_polo.convex_polygon import ConvexPolygon
from agents.marco_polo_game.guidance import Deck, Deployment, Guidance, Plan, longest_stay_ns
from agents.marco_polo_game.link_watch import LinkWatch
from agents.marco_polo_game.reachable_set import EmptyView, ReachableSet
from agents.marco_polo_game.track import STEP_NS, Seen, Track
from agents.pursuit import Place
from agents.pursuit.no_escape import NOISE_SIGMAS
from agents.pursuit.pursuer import Pursuer

LEFT: Final = "left S"                  # how the causes of failed pursuits begin
LOST_LINK: Final = "lost link"
NEVER: Final = -1_000_000_000_000


@dataclass
class _Chase:
    """Knowledge that a UGV has of its target during one deployment.

    Invariant: `newest` is the newest detection that the filter has."""

    track: Track
    pursuer: Pursuer
    reach: ReachableSet
    links: LinkWatch
    newest: Seen
    known_ns: set[int] = field(default_factory=set)     # times of the detections that the filter has
    latest_ns: int = 0                                  # at which the target can be in the area
    asked_ns: int = NEVER                               # exposure of the last look
    answered_ns: int = NEVER                            # exposure of the last answer
    judged_ns: int = NEVER                              # exposure of the last look whose result is known
    gripped_ns: int = NEVER                             # of a grip that the target cannot but have answered


class AdaptivePursuit(Guidance):
    def __init__(self, deck: Deck) -> None:
        game, name = deck.game, deck.board.name
        self._deck = deck
        self._radius_m, self._speed_mps = game.radius_m[name], game.speed_mps(name)
        self._v_max_mps = game.parameters.target_greatest_mps
        self._step_ns = deck.settings.exposure_ns
        self._margin_m = NOISE_SIGMAS * deck.settings.sigma_m       # by which a detection may be off
        (west, east), (south, north) = game.area.x_m, game.area.y_m
        self._obstacles = [ConvexPolygon(corners) for corners in game.obstacles]
        self._across_ns = round(dist((west, south), (east, north)) / self._speed_mps * 1e9)
        self._chase: _Chase | None = None
        self._lost, self._ends_ns = "", 0

    @property
    def lost(self) -> str:
        return self._lost

    @property
    def ends_ns(self) -> int:
        return self._ends_ns

    def begin(self, deployment: Deployment, now_ns: int) -> None:
        deck, settings, track = self._deck, self._deck.settings, deployment.track
        game, name = deck.game, deck.board.name
        seen = sorted({*track.seen.values(), *([track.sight] if track.sight else [])})
        told_within_ns = 2 * self._step_ns + BidTiming(len(game.sensors), settings).silence_ns
        links = LinkWatch(name, game.targets[deployment.target], (settings.radio, settings.view, settings.grip),
                          told_within_ns, seen[-1].at_ns)
        reach = ReachableSet(game.area, self._v_max_mps, self._margin_m)
        self._chase = _Chase(track, settings.pursuer(game, name), reach, links, seen[0])
        for each in seen:
            self.saw(each)

    def end(self) -> None:
        self._chase = None

    # --- detections and looks

    def saw(self, seen: Seen) -> bool:
        """Give the filter a detection; return whether it is the newest."""
        chase, now_ns = self._now, self._deck.board.now_ns
        if seen.at_ns in chase.known_ns or seen.at_ns > now_ns:
            return False
        chase.known_ns.add(seen.at_ns)
        chase.pursuer.detected(now_ns, seen.at_ns, seen.place, seen.place)
        if seen.at_ns < chase.newest.at_ns:
            return False
        chase.newest = seen
        chase.reach.seen(*seen)
        chase.latest_ns = self._ends_ns = seen.at_ns + self._longest_stay_ns(chase.track)
        return True

    def answered(self, exposed_ns: int) -> None:
        self._now.answered_ns = exposed_ns

    def _longest_stay_ns(self, track: Track) -> int:
        game = self._deck.game
        return longest_stay_ns(CTarget(track.forecast().track, self._radius_m, game.parameters.cone_content), game)

    def _judge_look(self, chase: _Chase, own: Place, now_ns: int) -> bool:
        """Take the result of the last look; return whether it is known, so that another look may be asked for."""
        if now_ns >= chase.gripped_ns + self._step_ns // 2 > 0:
            chase.links.grip_failed()
            chase.gripped_ns = NEVER
        if chase.asked_ns < 0 or chase.judged_ns == chase.asked_ns:
            return True
        if chase.asked_ns == chase.answered_ns:
            chase.judged_ns = chase.asked_ns
            self._judge_answer(chase, own, now_ns)
        elif now_ns >= chase.asked_ns + self._step_ns // 2:
            chase.judged_ns = chase.asked_ns
            chase.links.look_failed()
        return chase.judged_ns == chase.asked_ns

    def _judge_answer(self, chase: _Chase, own: Place, now_ns: int) -> None:
        sight, since_s = chase.track.sight, (now_ns - chase.asked_ns) * 1e-9
        if sight is not None and sight.at_ns == chase.asked_ns:
            surely_m = self._deck.game.parameters.capture_m - self._margin_m - self._v_max_mps * since_s
            if dist(own, sight.place) <= surely_m:
                chase.gripped_ns = now_ns
        elif self._speed_mps * since_s < self._radius_m:
            chase.reach.not_seen(EmptyView(chase.asked_ns, own, self._radius_m - self._speed_mps * since_s))

    # --- the plan

    def plan(self, own: Place, now_ns: int) -> Plan | None:
        chase = self._now
        exposure_ns = (now_ns // self._step_ns + 1) * self._step_ns
        known = self._judge_look(chase, own, now_ns)
        chase.links.listen(chase.track.seen, chase.track.out_of_view_ns, self._deck.scanning(), now_ns)
        proven = chase.reach.left(now_ns)
        if proven or now_ns >= chase.latest_ns:
            self._ends_ns = min(now_ns, chase.latest_ns)
            why = f"{LEFT}: {'looks found all empty that it can reach' if proven else 'no target stays longer'}"
            self._lost = f"{LOST_LINK} {', '.join(chase.links.failed)}; {why}" if chase.links.failed else why
            return None
        way = self._way(own, self._intercept(chase, own, now_ns))
        look = known and exposure_ns > chase.asked_ns and self._wants_look(
            chase, self._ahead(own, way, exposure_ns - now_ns), now_ns, exposure_ns)
        if look:
            chase.asked_ns = exposure_ns
            chase.pursuer.asked(exposure_ns)
        return Plan(way, exposure_ns + self._step_ns // 2, look)

    def _wants_look(self, chase: _Chase, own: Place, now_ns: int, exposure_ns: int) -> bool:
        """Return whether to look at the next exposure, from `own`, where the sensor is then."""
        game, expected = self._deck.game, chase.pursuer.estimator.expect(exposure_ns)
        way_m = self._v_max_mps * (exposure_ns - chase.newest.at_ns) * 1e-9
        if dist(own, chase.newest.place) - way_m > self._radius_m:
            return False                            # it cannot be in view
        if (dist(own, expected) <= game.parameters.capture_m or game.area.nearest(expected) != expected
                or any(obstacle.depth_m(expected) > 0.0 for obstacle in self._obstacles)):
            return True
        return chase.pursuer.step(now_ns, own).look_ns <= exposure_ns

    def _intercept(self, chase: _Chase, own: Place, now_ns: int) -> Place:
        """Return the first expected place, to `STEP_NS`, where the sensor is no later than the target.

        The last one within the area, if the target is expected to leave before."""
        area, goal = self._deck.game.area, own
        for at_ns in range(now_ns, now_ns + self._across_ns, STEP_NS):
            place = chase.pursuer.estimator.expect(at_ns)
            goal = chase.reach.nearest(area.nearest(place), at_ns)
            if area.nearest(place) != place or dist(own, goal) <= self._speed_mps * (at_ns - now_ns) * 1e-9:
                break
        return goal

    def _way(self, own: Place, goal: Place) -> list[Place]:
        """Return the waypoints to `goal`: straight if the leg is clear, else by cells."""
        ground = self._deck.ground
        return [goal] if ground.clear(own, goal) else ground.way(self._deck.graph(), own, goal)

    def _ahead(self, own: Place, way: Sequence[Place], after_ns: int) -> Place:
        """Return where the sensor is on its way after `after_ns`."""
        left_m = self._speed_mps * after_ns * 1e-9
        for to in way:
            leg_m = dist(own, to)
            if leg_m > left_m:
                share = left_m / leg_m
                return own[0] + share * (to[0] - own[0]), own[1] + share * (to[1] - own[1])
            own, left_m = to, left_m - leg_m
        return own

    @property
    def _now(self) -> _Chase:
        assert self._chase is not None
        return self._chase

"""The guidance of an adaptive pursuit by itself: when it looks, where it drives, and why it ends."""

from __future__ import annotations

from dataclasses import replace
from math import dist
from types import SimpleNamespace
from typing import Any

import pytest

from agents.marco_polo.connectivity import Route
from agents.marco_polo.game_parameters import GameParameters
from agents.marco_polo.reward import Offer
from agents.marco_polo_game.adaptive_pursuit import LEFT, AdaptivePursuit
from agents.marco_polo_game.adaptive_settings import AdaptiveSettings
from agents.marco_polo_game.game_table import Game
from agents.marco_polo_game.guidance import Deck, Deployment, Plan
from agents.marco_polo_game.track import Seen, Track
from agents.pursuit import Place
from agents.pursuit.law import Area

S, MS = 1_000_000_000, 1_000_000
AREA = Area((0.0, 10.0), (0.0, 10.0))
GAME = Game(("uav", "ugv"), ("target",), frozenset({"ugv"}), {"uav": 1.5, "ugv": 1.0}, AREA, GameParameters())
SETTINGS = AdaptiveSettings(view="view", slot_ns=5 * MS, window_ns=150 * MS, exposure_ns=100 * MS,
                            exposure_latency_ns=20 * MS)
UGV_MPS = GAME.parameters.ugv_mps


class Chase:
    """A guidance with a robot that drives as it says and whose camera answers every look; half an exposure a step."""

    def __init__(self, own: Place, detections: list[Seen], game: Game = GAME, answers: bool = True) -> None:
        self.board: Any = SimpleNamespace(name="ugv", now_ns=detections[-1].at_ns + 50 * MS)
        self.standing: dict[str, Place] = {}
        ground = game.ground(ugv=True)
        deck = Deck(self.board, SETTINGS, game, ground, ground.graph, lambda: self.standing)
        self.guidance, self.own, self.looks, self.answers = AdaptivePursuit(deck), own, [], answers
        self.track = Track(AREA, game.parameters)
        for number, seen in enumerate(detections):
            self.track.detected("uav" if seen is detections[-1] else f"other {number}", seen)
        self.guidance.begin(Deployment(0, self.track, Offer(0.0, 0, Route([0], 0.0), 0.0, 0.0)), self.board.now_ns)

    def step(self, target: Place | None) -> Plan | None:
        """Plan, drive for 100 ms, and answer a look by where the target is; `target` is None: out of the area."""
        plan = self.guidance.plan(self.own, self.board.now_ns)
        if plan is None:
            return None
        exposure_ns = self.board.now_ns + 50 * MS
        assert plan.again_ns == exposure_ns + 50 * MS
        at_exposure = self._drive(plan, 0.05)
        self.own = self._drive(plan, 0.1)
        self.board.now_ns = plan.again_ns
        if plan.look:
            self.looks.append(exposure_ns)
            if self.answers:
                self.guidance.answered(exposure_ns)
                if target is not None and dist(at_exposure, target) <= 1.0:
                    self.track.sight = Seen(exposure_ns, target)
                    self.guidance.saw(self.track.sight)
        return plan

    def _drive(self, plan: Plan, for_s: float) -> Place:
        (x, y), left_m = self.own, UGV_MPS * for_s
        for to in plan.way:
            leg_m = dist((x, y), to)
            share = min(1.0, left_m / leg_m) if leg_m else 1.0
            x, y, left_m = x + share * (to[0] - x), y + share * (to[1] - y), max(0.0, left_m - leg_m)
        return x, y


def straight(at_s: float, until_s: float, place: Place, vx: float, vy: float) -> list[Seen]:
    """Three detections of a target that is at `place` at the last of them, at `until_s`."""
    return [Seen(round(t * S), (place[0] + vx * (t - until_s), place[1] + vy * (t - until_s)))
            for t in (at_s, 0.5 * (at_s + until_s), until_s)]


def test_it_drives_to_where_it_meets_a_target_that_goes_straight() -> None:
    """Target from (5, 5) at 0.5 m/s to the right, UGV at (7, 3) with 1.2 m/s: |(2 - 0.5 t, -2)| = 1.2 t."""
    chase = Chase((7.0, 3.0), straight(2.0, 4.0, (5.0, 5.0), 0.5, 0.0))

    plan = chase.step((5.05, 5.0))

    assert plan is not None
    t_s = (-2 + (4 + 4 * 8 * 1.19) ** 0.5) / (2 * 1.19)           # from 1.19 t^2 + 2 t - 8 = 0
    goal, = plan.way
    assert goal == pytest.approx((5.0 + 0.5 * t_s, 5.0), abs=0.5 * 0.1 + 0.5 * 0.05)     # to one step of the search


def test_it_does_not_look_before_the_target_can_be_in_view() -> None:
    """At 4 m and 1.2 + 0.7 m/s at most, nothing is in view for (4 - 1) / 1.9 = 1.58 s."""
    chase = Chase((9.0, 5.0), straight(2.0, 4.0, (5.0, 5.0), 0.5, 0.0))

    for k in range(40):
        chase.step((5.0 + 0.05 * k, 5.0))

    assert 4 * S + 1580 * MS <= chase.looks[0] <= 4 * S + 1800 * MS
    assert len(chase.looks) < 20


def test_a_target_in_view_is_looked_at_rarely_and_never_lost() -> None:
    """The UGV drives towards it; once near, it looks where it expects to capture."""
    chase = Chase((6.0, 3.5), straight(2.0, 4.0, (5.5, 4.0), 0.3, 0.3))

    found = []
    for k in range(8):
        x = 5.5 + 0.03 * k
        before = len(chase.looks)
        chase.step((x, 4.0 + 0.03 * k))
        if len(chase.looks) > before:
            found.append(chase.track.sight is not None and chase.track.sight.at_ns == chase.looks[-1])

    assert found
    assert all(found)


def test_the_ways_of_a_target_that_turns_lead_to_its_capture() -> None:
    """A zig-zag of 0.7 m/s: a new heading every 2 s. The UGV comes within the capture distance all the same."""
    chase, (x, y) = Chase((8.0, 8.0), straight(2.0, 4.0, (5.0, 5.0), 0.5, 0.5)), (5.0, 5.0)
    nearest_m = 99.0

    for k in range(150):
        vx, vy = ((0.7, 0.0), (0.0, -0.7), (-0.7, 0.0), (0.0, 0.7))[k // 20 % 4]
        x, y = x + 0.1 * vx, y + 0.1 * vy
        assert chase.step((x, y)) is not None
        nearest_m = min(nearest_m, dist(chase.own, (x, y)))

    assert nearest_m < 0.5


def test_a_target_that_leaves_in_view_has_left_at_the_first_look_in_vain() -> None:
    chase = Chase((8.8, 5.0), straight(2.0, 4.0, (9.9, 5.0), 0.7, 0.0))

    plans = [chase.step(None) for _ in range(12)]

    assert plans[-1] is None
    assert chase.guidance.lost == LEFT
    assert chase.guidance.ends_ns <= chase.board.now_ns
    assert chase.board.now_ns < 6 * S


def test_a_pursuit_without_any_answer_names_the_link_of_its_camera() -> None:
    chase = Chase((8.5, 5.0), straight(2.0, 4.0, (9.0, 5.0), 0.3, 0.0), answers=False)

    plans = [chase.step((9.0, 5.0)) for _ in range(900)]

    assert plans[-1] is None
    assert chase.guidance.lost == "lost link view: target -> ugv"


def test_a_pursuit_that_finds_nothing_names_the_sensor_that_told_no_more() -> None:
    """The target was in the middle of a view of 1.5 m, so it was to be told of for 2 s more."""
    chase = Chase((1.0, 9.0), straight(2.0, 4.0, (8.0, 2.0), 0.3, 0.0))
    chase.standing["uav"] = (8.0, 2.0)

    while chase.step(None) is not None:
        assert chase.board.now_ns < 200 * S

    assert chase.guidance.lost == "lost link radio: uav -> ugv"


@pytest.mark.parametrize(("obstacles", "looks"), [
    ((), False),
    ((((5.18, 4.5), (5.5, 4.5), (5.5, 5.1), (5.18, 5.1)),), True),
    ((((5.22, 4.5), (5.5, 4.5), (5.5, 5.1), (5.22, 5.1)),), False),
])
def test_it_looks_where_the_prediction_meets_an_obstacle(obstacles: Any, looks: bool) -> None:
    """After the three first looks the target, 0.6 m away, is surely in view for 0.18 s; at 4.4 s it is at x = 5.2."""
    chase = Chase((5.0, 5.6), straight(2.0, 4.0, (5.0, 5.0), 0.5, 0.0), replace(GAME, obstacles=obstacles))
    for exposure_ns in (4100 * MS, 4200 * MS, 4300 * MS):
        x = 5.0 + 0.5e-9 * (exposure_ns - 4 * S)
        plan = chase.guidance.plan((x, 5.6), exposure_ns - 50 * MS)
        assert plan is not None
        assert plan.look
        chase.board.now_ns = exposure_ns + 20 * MS
        chase.guidance.answered(exposure_ns)
        chase.guidance.saw(Seen(exposure_ns, (x, 5.0)))

    plan = chase.guidance.plan((5.2, 5.6), 4350 * MS)

    assert plan is not None
    assert plan.look is looks


def test_a_camera_that_is_too_short_sighted_is_refused_with_what_would_do() -> None:
    game = replace(GAME, radius_m={"uav": 1.5, "ugv": 0.3})

    with pytest.raises(ValueError, match=r"team\.radius_m\.ugv=0\.3: .* take 0\.694 m or more"):
        SETTINGS.pursuer(game, "ugv")


@pytest.mark.parametrize(("change", "said"), [
    ({"exposure_latency_ns": 50 * MS}, "less than half of exposure_ns=100000000"),
    ({"rho_m": -1.0}, "rho_m=-1.0: expected 0 or more"),
    ({"sigma_m": float("nan")}, "sigma_m=nan: expected 0 or more"),
    ({"filter_window": 2}, "a circle needs Gamma of 3 detections or more"),
])
def test_settings_that_cannot_be_are_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        replace(SETTINGS, **change)

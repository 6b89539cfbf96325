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
    """A guidance with a robot that drives as it says, 100 ms a step, and whose camera answers 20 ms after exposures."""

    def __init__(self, own: Place, detections: list[Seen], game: Game = GAME, answers: bool = True) -> None:
        self.board: Any = SimpleNamespace(name="ugv", now_ns=detections[-1].at_ns + 50 * MS)
        self.scanning: list[str] = []
        ground = game.ground(ugv=True)
        deck = Deck(self.board, SETTINGS, game, ground, ground.graph, lambda: self.scanning)
        self.guidance, self.own, self.answers = AdaptivePursuit(deck), own, answers
        self.looks: list[int] = []                      # exposures that were asked for
        self.sights_ns: list[int] = []
        self.track = Track(AREA, game.parameters)
        for number, seen in enumerate(detections):
            self.track.detected("uav" if seen is detections[-1] else f"other {number}", seen)
        offer = Offer(0.0, 0, Route([0], 0.0), 0.0, 0.0)
        self.guidance.begin(Deployment(0, self.track, offer, own), self.board.now_ns)

    def step(self, target: Place | None) -> Plan | None:
        """Go on to 50 ms after the next exposure, at which the target is at `target`; None: it is out of the area."""
        exposure_ns = self.board.now_ns + 50 * MS
        plan = first = self._plan()
        if plan is None:
            return None
        assert plan.again_ns == exposure_ns + 50 * MS
        self._drive(plan, exposure_ns)
        if self.answers and exposure_ns in self.looks:
            in_view = target is not None and dist(self.own, target) <= 1.0
            self._drive(plan, exposure_ns + 20 * MS)
            self.guidance.answered(exposure_ns)
            if in_view and target is not None:
                self.sights_ns.append(exposure_ns)
                self.track.sight = Seen(exposure_ns, target)
                if self.guidance.saw(self.track.sight) and (plan := self._plan()) is None:
                    return None
        self._drive(plan, exposure_ns + 50 * MS)
        return first

    def _plan(self) -> Plan | None:
        plan = self.guidance.plan(self.own, self.board.now_ns)
        if plan is not None and plan.look:
            self.looks.append(plan.again_ns - 50 * MS)
        return plan

    def _drive(self, plan: Plan, until_ns: int) -> None:
        left_m = UGV_MPS * (until_ns - self.board.now_ns) * 1e-9
        for to in plan.way:
            leg_m = dist(self.own, to)
            share = min(1.0, left_m / leg_m) if leg_m else 1.0
            self.own = (self.own[0] + share * (to[0] - self.own[0]), self.own[1] + share * (to[1] - self.own[1]))
            left_m = max(0.0, left_m - leg_m)
        self.board.now_ns = until_ns


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

    for k in range(25):
        chase.step((5.0 + 0.05 * k, 5.0))

    assert 4 * S + 1580 * MS <= chase.looks[0] <= 4 * S + 1800 * MS


@pytest.mark.parametrize("turn_s", [0.5, 1.0, 2.0])
def test_a_target_in_view_that_turns_again_and_again_is_caught(turn_s: float) -> None:
    """At 0.7 m/s around a square, for the UGV is faster and in view at first."""
    chase, (x, y) = Chase((5.9, 5.0), straight(2.0, 4.0, (5.0, 5.0), -0.5, 0.5)), (5.0, 5.0)
    nearest_m = [dist(chase.own, (x, y))]

    for k in range(40):
        vx, vy = ((-0.7, 0.0), (0.0, -0.7), (0.7, 0.0), (0.0, 0.7))[int(k / (10 * turn_s)) % 4]
        x, y = x + 0.1 * vx, y + 0.1 * vy
        assert chase.step((x, y)) is not None
        nearest_m.append(dist(chase.own, (x, y)))

    assert min(nearest_m) < GAME.parameters.capture_m
    assert max(nearest_m) < 1.0
    exposed = [look_ns for look_ns in chase.looks if look_ns < chase.board.now_ns]
    assert chase.sights_ns == exposed                   # no look is in vain


def test_a_target_that_leaves_in_view_has_left_at_the_first_look_in_vain() -> None:
    chase = Chase((8.8, 5.0), straight(2.0, 4.0, (9.9, 5.0), 0.7, 0.0))

    plans = [chase.step(None) for _ in range(12)]

    assert plans[-1] is None
    assert chase.guidance.lost.startswith(LEFT)
    assert chase.guidance.ends_ns <= chase.board.now_ns
    assert chase.board.now_ns < 6 * S


def test_a_pursuit_without_any_answer_names_the_link_of_its_camera() -> None:
    chase = Chase((8.5, 5.0), straight(2.0, 4.0, (9.0, 5.0), 0.3, 0.0), answers=False)

    plans = [chase.step((9.0, 5.0)) for _ in range(900)]

    assert plans[-1] is None
    assert chase.guidance.lost.startswith("lost link view: target -> ugv; left S")


@pytest.mark.parametrize(("out_ns", "lost"), [({}, "lost link radio: uav -> ugv; left S"), ({"uav": 4100 * MS}, LEFT)])
def test_a_pursuit_that_finds_nothing_names_the_sensor_that_told_no_more(out_ns: dict[str, int], lost: str) -> None:
    """The sensor `uav` told the last sight, at 4 s, and has to tell at the next exposure whether it sees the target."""
    chase = Chase((1.0, 9.0), straight(2.0, 4.0, (8.0, 2.0), 0.3, 0.0))
    chase.scanning.append("uav")
    chase.track.out_of_view_ns.update(out_ns)

    while chase.step(None) is not None:
        assert chase.board.now_ns < 200 * S

    assert chase.guidance.lost.startswith(lost)


def test_grips_without_an_answer_are_the_cause_if_the_target_gets_away() -> None:
    chase = Chase((9.0, 5.0), straight(2.0, 4.0, (9.3, 5.0), 0.3, 0.0))

    plans = [chase.step((9.3 + 0.03 * k, 5.0) if k < 23 else None) for k in range(40)]

    assert plans[-1] is None
    assert chase.guidance.lost.startswith("lost link grip: ugv -> target; left S: looks found all empty")


@pytest.mark.parametrize(("away_m", "obstacles", "looks"), [
    (0.6, (), False),
    (0.6, (((5.18, 4.5), (5.5, 4.5), (5.5, 5.1), (5.18, 5.1)),), True),
    (0.6, (((5.22, 4.5), (5.5, 4.5), (5.5, 5.1), (5.22, 5.1)),), False),
    (0.53, (), True),                                   # at 4.4 s the UGV is 0.06 m nearer: it can capture the target
])
def test_it_looks_where_the_prediction_meets_an_obstacle_or_the_capture(away_m: float, obstacles: Any,
                                                                        looks: bool) -> None:
    """After the three first looks the target is surely in view for 0.18 s or more; at 4.4 s it is at (5.2, 5)."""
    chase = Chase((5.0, 5.0 + away_m), straight(2.0, 4.0, (5.0, 5.0), 0.5, 0.0), replace(GAME, obstacles=obstacles))
    for exposure_ns in (4100 * MS, 4200 * MS, 4300 * MS):
        x = 5.0 + 0.5e-9 * (exposure_ns - 4 * S)
        plan = chase.guidance.plan((x, 5.6), exposure_ns - 50 * MS)
        assert plan is not None
        assert plan.look
        chase.board.now_ns = exposure_ns + 20 * MS
        chase.guidance.answered(exposure_ns)
        chase.guidance.saw(Seen(exposure_ns, (x, 5.0)))

    plan = chase.guidance.plan((5.2, 5.0 + away_m), 4350 * MS)

    assert plan is not None
    assert plan.look is looks


def test_looks_in_vain_do_not_forbid_what_the_target_can_reach_until_it_is_met() -> None:
    """The UGV is 1.3 m behind a target of 0.5 m/s: it meets it 1.3 / 0.7 s later, 0.93 m further on."""
    chase = Chase((6.3, 5.0), straight(2.0, 4.0, (5.0, 5.0), -0.5, 0.0))

    plans = [chase.step((5.0 - 0.05 * (k + 1), 5.0)) for k in range(3)]

    assert chase.looks[0] == 4200 * MS
    assert chase.sights_ns == []
    assert plans[-1] is not None
    assert plans[-1].way[0] == pytest.approx((5.0 - 0.5 * 1.3 / 0.7, 5.0), abs=0.1)


def test_a_camera_that_is_too_short_sighted_is_refused_with_what_would_do() -> None:
    game = replace(GAME, radius_m={"uav": 1.5, "ugv": 0.3})

    with pytest.raises(ValueError, match=r"team\.radius_m\.ugv=0\.3: .* take 0\.694 m or more"):
        SETTINGS.pursuer(game, "ugv")
    replace(SETTINGS, sure=False).pursuer(game, "ugv")


@pytest.mark.parametrize(("change", "said"), [
    ({"exposure_latency_ns": 50 * MS}, "less than half of exposure_ns=100000000"),
    ({"rho_m": -1.0}, "rho_m=-1.0: expected 0 or more"),
    ({"sigma_m": float("nan")}, "sigma_m=nan: expected 0 or more"),
    ({"filter_window": 2}, "a circle needs Gamma of 3 detections or more"),
])
def test_settings_that_cannot_be_are_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        replace(SETTINGS, **change)

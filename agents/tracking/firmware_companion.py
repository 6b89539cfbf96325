"""Checks a scenario for the tracking robot in C (`firmware_sim/firmware/tracking_robot`), and configures it.

`configure` computes what the trigger needs before the robot starts: the table of gains, the table D of `heading_slope`,
and a decision at x = 0, which for the policy `periodic` is that of every state.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from agents.tracking.check import problems_of_companions
from agents.tracking.controller import TrackingController
from agents.tracking.error_system import LIMITS, NOISE
from agents.tracking.heading_slope import HeadingSlope, heading_table
from agents.tracking.planned_gains import gains_of
from agents.tracking.team_policy import make_policy
from agents.tracking.tracking_settings import TrackingSettings
from agents.triggering.error_gain import KAPPA
from firmware_sim.scenario_view import Own, OwnAgent, ScenarioView


class TrackingFirmware:
    """The companion of the firmware tracking_robot, whose parameters are those of `TrackingSettings`."""

    @staticmethod
    def check(scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
        """Yield the reasons why these robots cannot track."""
        for name, agent in own.items():
            if len(agent.settings.start) != 3:
                yield f"agents.{name}.parameters.start: {len(agent.settings.start)} numbers: expected x, y and heading"
        yield from problems_of_companions(scenario, {name: OwnAgent(name, _settings(agent.settings), agent.agent)
                                                     for name, agent in own.items()}, overlapping=False)

    @staticmethod
    def configure(table: Mapping[str, Any], name: str, settings: Any) -> dict[str, Any]:
        """Return the rows of [[configuration]] for the robot `name`; `table` is the scenario's [team]."""
        robot, gains, controller = table["robot"], gains_of(table), TrackingController()
        slope = HeadingSlope(controller.k2_per_m2, controller.k3_per_s)
        own = _settings(settings)
        at_rest = make_policy(table, own.policy, own.policy_settings()).decide(0, (0.0, 0.0, 0.0), LIMITS)
        return {
            "wheel_radius_m": robot["wheel_radius_m"],
            "track_m": robot["track_m"],
            "counts_per_turn": robot["counts_per_turn"],
            "k": [controller.k1_per_s, controller.k2_per_m2, controller.k3_per_s],
            "limits": list(LIMITS),
            "planned_gains": [list(row) for row in gains.rows],
            "largest_gain": gains.unified,
            "kappa": KAPPA,
            "noise_bound": NOISE,
            "slope": [list(row) for row in heading_table()],
            "slope_step_m": slope.step_m,
            "slope_bump": slope.bump,
            "certified_ns": at_rest.valid_ns,
            "certified_growth": at_rest.growth_per_s,
        }


def _settings(parameters: Any) -> TrackingSettings:
    return TrackingSettings(**vars(parameters))

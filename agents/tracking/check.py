"""Problems of a tracking scenario, found before a run: one sentence each, with the remedy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import pairwise
from math import isfinite
from typing import Any

from agents.tracking.drive_limits import rim_speed
from agents.tracking.look_delay import BUS, RADIO, delay_problems, look_delay, reference_inputs
from agents.tracking.optimal_preparation import POLICY, optimal_problems
from agents.tracking.team_policy import make_policy
from agents.tracking.tracking_settings import TrackingSettings
from firmware_sim.scenario_view import Own, OwnAgent, ScenarioView

ROBOT = ("wheel_radius_m", "track_m", "counts_per_turn")


def companion_problems(scenario: ScenarioView, own: Own[TrackingSettings]) -> Iterator[str]:
    """Yield a problem for gains that certify no horizon, an unknown policy, missing wheel parameters, missing ports, a
    delay that leaves no interval, a reference that the robot's wheels cannot follow."""
    yield from problems_of_companions(scenario, own)


def problems_of_companions(scenario: ScenarioView, own: Own[TrackingSettings], *,
                           overlapping: bool = True) -> Iterator[str]:
    """As `companion_problems`; `overlapping`: whether these robots send a request before the last one is answered."""
    for name, agent in own.items():
        settings, needed = agent.settings, [RADIO, BUS]
        if settings.policy == POLICY:               # its tables, which take seconds, are made before the run
            yield from optimal_problems(scenario)
            if settings.sure and (delay_ns := look_delay(scenario, name).total_ns):
                yield (f"agents.{name}.parameters.policy={POLICY!r}: its tables take no delay of looks into account, "
                       f"and here looks take {delay_ns} ns: take the delay away, choose \"individual_gains\", or set "
                       f"agents.{name}.parameters.sure = false to run it all the same")
        else:
            try:
                policy = make_policy(scenario.team, settings.policy, settings.policy_settings())
                needed += ["view"] if policy.watch_ns else []
            except (ValueError, TypeError, KeyError) as error:
                yield f"agents.{name}.parameters: {error}"
            else:
                if settings.sure:
                    yield from delay_problems(scenario, name, policy, look_delay(scenario, name),
                                              overlapping=overlapping)
        yield from wheel_problems(scenario, name)
        if settings.sure and settings.speed_max_mps:
            yield from _too_fast(scenario, name, settings.speed_max_mps)
        yield from _missing_ports(name, agent, needed)


def prepared_delays(scenario: ScenarioView, own: Own[TrackingSettings]) -> dict[str, Any]:
    """Return the table `look_delays` of the team, of the robots whose looks take a known time; nothing without any."""
    delays = {name: asdict(delay) for name in own if (delay := look_delay(scenario, name)).total_ns}
    return {"look_delays": delays} if delays else {}


def _too_fast(scenario: ScenarioView, name: str, speed_max_mps: float) -> Iterator[str]:
    """Yield a problem for the first inputs of the reference that need faster wheels."""
    track_m = scenario.team.get("robot", {}).get("track_m", 0.0)
    for inputs in reference_inputs(scenario.team):
        if (rim_mps := rim_speed(inputs, track_m)) > speed_max_mps:
            yield (f"agents.{name}.parameters.speed_max_mps={speed_max_mps:g}: the reference drives ({inputs.v_mps:g}, "
                   f"{inputs.omega_rad_s:g}), for which a rim of its wheels would turn at {rim_mps:.4g} m/s: it cannot "
                   f"follow; slow the reference down, or set agents.{name}.parameters.sure = false to run it all the "
                   "same")
            return


def wheel_problems(scenario: ScenarioView, name: str) -> Iterator[str]:
    """Yield a problem if the scenario does not tell robot `name` what it needs to know of its wheels."""
    if lacking := [key for key in ROBOT if key not in scenario.team.get("robot", {})]:
        yield f"team.robot: is missing {', '.join(lacking)}, which {name} needs to know of its wheels"


def reference_problems(scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
    """Yield a problem for a missing plant, missing or wrong instants of the inputs, a missing radio."""
    for name, agent in own.items():
        if not agent.has_plant:
            yield f"agents.{name}.plant: is missing; a reference robot drives one: {{ fmu = \"virtual_reference\" }}"
        table = scenario.team.get("reference")
        from_s = table.get("from_s") if isinstance(table, Mapping) else None
        if from_s is None:
            yield (f"team.reference.from_s: is missing: the instants at which {name} changes its inputs and says so; "
                   "write from_s, v_mps and omega_radps there and parameters_from = \"team.reference\" in its plant")
        elif not _later_and_later(from_s):
            yield f"team.reference.from_s={from_s}: expected a list of later and later instants [s]"
        yield from _missing_ports(name, agent, ("radio",))


def _missing_ports(name: str, agent: OwnAgent[Any], needed: Sequence[str]) -> Iterator[str]:
    if lacking := [port for port in needed if port not in agent.media]:
        yield (f"agents.{name}.media: lacks {', '.join(lacking)}; it has {', '.join(agent.media) or 'none'}, "
               f"and its program speaks on media of these names")


def _later_and_later(from_s: object) -> bool:
    """Return whether the entries of at least 0 ascend; pieces with a negative one are not in use."""
    if not isinstance(from_s, list) or not all(isinstance(each, int | float) and isfinite(each) for each in from_s):
        return False
    return all(one < next_one for one, next_one in pairwise(each for each in from_s if each >= 0))

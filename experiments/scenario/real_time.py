"""A scenario with another pace of the wall clock than its file says, as `marconet.run(rate=...)` asks for."""

from __future__ import annotations

from dataclasses import replace

from msgspec.structs import replace as replace_fields

from experiments.scenario.model import Scenario
from netem.gateways.real_time_settings import FASTEST, SLOWEST


def at_rate(scenario: Scenario, rate: float) -> Scenario:
    """Return `scenario` with this rate, noted among its changes; raises ValueError if the rate is out of range."""
    if not SLOWEST <= rate <= FASTEST:
        raise ValueError(f"rate={rate}: expected virtual seconds per second of the wall clock, from {SLOWEST:g} to "
                         f"{FASTEST:g}")
    return replace_fields(scenario, real_time=replace(scenario.real_time, rate=float(rate)),
                          changes={**scenario.changes, "real_time.rate": float(rate)})

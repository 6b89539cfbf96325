"""The policies by the names that scenarios use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from agents.triggering.assumptions import Assumption
from agents.triggering.error_gain import KAPPA
from agents.triggering.error_system import ErrorSystem
from agents.triggering.gain_table import GainTable
from agents.triggering.policies import Policy
from agents.triggering.policies.delayed import Delayed
from agents.triggering.policies.event_triggered import MS, EventTriggered
from agents.triggering.policies.input_output import IndividualGains, UnifiedGain
from agents.triggering.policies.interval_table import IntervalTable
from agents.triggering.policies.loss_tolerant import LossTolerant
from agents.triggering.policies.optimal import Optimal
from agents.triggering.policies.periodic import Periodic
from agents.triggering.policies.regional_gains import RegionalGains


@dataclass(frozen=True)
class PolicySettings:
    """The settings of all policies; each policy uses its own."""

    kappa: float = KAPPA
    max_successive_losses: int = 0      # N^D
    radius: float = 10.0                # periodic: largest |x| for which the period is certified
    period_ns: int | None = None        # periodic: a period instead of the certified one
    watch_ns: int = MS                  # event_triggered: time between looks
    delay_ns: int = 0                   # d: from a request to the moment at which the command from its answer acts
    floor_ns: int = 1                   # shortest interval that the delay may leave
    tables: Mapping[tuple[float, ...], IntervalTable] | None = None     # optimal: by inputs


System = ErrorSystem[Any, Any]


class PolicyKind(NamedTuple):
    build: Callable[[System, GainTable, PolicySettings], Policy[Any, Any]]
    measurable: frozenset[Assumption]       # of what it assumes, what a measurement shows


POLICIES: Final = {
    "individual_gains": PolicyKind(lambda system, gains, s: IndividualGains(system, gains, s.kappa), frozenset(
        (Assumption.INPUTS, Assumption.ANNOUNCED, Assumption.GAIN))),
    "regional_gains": PolicyKind(lambda system, gains, s: RegionalGains(system, gains, s.kappa), frozenset(
        (Assumption.INPUTS, Assumption.ANNOUNCED, Assumption.GAIN, Assumption.REGION))),
    "unified_gain": PolicyKind(lambda system, gains, s: UnifiedGain(system, gains, s.kappa), frozenset(
        (Assumption.INPUTS, Assumption.ANNOUNCED))),
    "periodic": PolicyKind(lambda system, gains, s: Periodic(
        IndividualGains(system, gains, s.kappa), s.radius, s.period_ns), frozenset(
        (Assumption.INPUTS, Assumption.ANNOUNCED, Assumption.RADIUS))),
    "event_triggered": PolicyKind(lambda system, gains, s: EventTriggered(
        IndividualGains(system, gains, s.kappa), s.watch_ns), frozenset(
        (Assumption.INPUTS, Assumption.ANNOUNCED, Assumption.GAIN))),
    "optimal": PolicyKind(lambda system, gains, s: Optimal(
        s.tables, IndividualGains(system, gains, s.kappa)), frozenset(
        (Assumption.INPUTS, Assumption.ANNOUNCED, Assumption.GAIN, Assumption.TABLE))),
}


def build_policy(name: str, system: System, gains: GainTable,
                 settings: PolicySettings | None = None) -> Policy[Any, Any]:
    """Return the policy `name`, as LossTolerant if the settings allow losses, and Delayed if looks take a known time.

    ValueError for an unknown name."""
    if name not in POLICIES:
        raise ValueError(f"policy={name!r}: expected one of {', '.join(POLICIES)}")
    settings = PolicySettings() if settings is None else settings
    policy = POLICIES[name].build(system, gains, settings)
    if settings.max_successive_losses:
        policy = LossTolerant(policy, settings.max_successive_losses)
    return Delayed(policy, settings.delay_ns, settings.floor_ns) if settings.delay_ns else policy

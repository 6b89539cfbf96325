"""Reasons why the observers or the models of a team cannot work over one graph, found before a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from agents.synchronization.late_values import AddedDelay
from agents.synchronization.model_hold import Hold
from agents.synchronization.model_loop import ModelLoop, slot_limit_ns
from agents.synchronization.observer import observer_gain
from agents.synchronization.round_plan import RoundPlan
from agents.synchronization.team import Team
from netem.core.link_name import LinkName
from netem.wire.instants import in_ms

SCANNED = 32        # slot lengths that are tried for the remedy


def observer_problems(team: Team, plan: RoundPlan) -> Iterator[str]:
    """Yield the observers whose poles cannot be placed with a measurement every round."""
    for name, model in team.models.items():
        if model.observer_poles:
            try:
                observer_gain(model.agent, model.observer_poles, plan.round_ns * 1e-9)
            except ValueError as error:
                yield f"team.models.{name}.{error}"


def model_problems(team: Team, plan: RoundPlan) -> Iterator[str]:
    """Yield why the exact map of a round with model-based holds is not that of a stable loop."""
    if team.hold is Hold.VALUE:
        return
    poles = [model.observer_poles for model in team.models.values()]
    loop = ModelLoop(tuple(team.agents), plan.laplacian, plan.parts, poles, team.hold, team.hold_steps)
    step_ns = plan.slot_ns // team.hold_steps
    if team.data_delay_ns >= step_ns:
        yield (f"team.hold_steps={team.hold_steps}: a frame comes {in_ms(team.data_delay_ns)} after its slot began: "
               f"expected less than {in_ms(step_ns)}, the time between control instants; use fewer, or a faster radio")
        return
    radius = loop.spectral_radius(plan.slot_ns, team.data_delay_ns)
    if team.sure and radius >= 1:
        longest_ns = slot_limit_ns(loop, max(1, plan.slot_ns // SCANNED), plan.slot_ns, team.data_delay_ns)
        yield (f"slots of {in_ms(plan.slot_ns)} make the sampled loop unstable: the exact map of a round with models "
               f"has the spectral radius {radius:.7g}, expected below 1; it is stable up to {in_ms(longest_ns or 0)}, "
               "or set team.sure = false to run it all the same")


def late_for_models(team: Team, added: Mapping[LinkName, AddedDelay]) -> Iterator[str]:
    """Yield the impairments that delay values by more than the robots know."""
    if team.hold is Hold.VALUE or not team.sure:
        return
    late = {place: delay.most_ns for delay in added.values() for place in delay.places}
    for place, most_ns in late.items():
        yield (f"{place}: a value may come {in_ms(most_ns)} late: the models bring a frame forward by airtime and "
               "receive latency alone; leave the delay out, or set team.sure = false to run it all the same")

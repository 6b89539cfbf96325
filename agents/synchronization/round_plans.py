"""The round plans of the topologies that a robot meets: from the team's table, or computed on board and cached."""

from __future__ import annotations

import numpy as np

from agents.synchronization.graph import Floats, laplacian_from_neighbours, neighbours
from agents.synchronization.model_hold import Hold
from agents.synchronization.round_plan import RoundPlan, plan_round
from agents.synchronization.team import TableEntry, Team

Heard = tuple[tuple[int, ...], ...]


def heard_by(laplacian: Floats) -> Heard:
    return tuple(tuple(int(j) for j in heard) for heard in neighbours(laplacian))


class RoundPlans:
    def __init__(self, team: Team) -> None:
        self._team = team
        self._plans: dict[Heard, RoundPlan | None] = {}
        for entry in team.designs:
            laplacian = laplacian_from_neighbours(entry.heard)
            self._plans[heard_by(laplacian)] = RoundPlan(laplacian, tuple(tuple(part) for part in entry.parts),
                                                         entry.slot_ns, entry.certified_ns, entry.assumed_ns)

    def plan(self, laplacian: Floats) -> RoundPlan | None:
        """Return the plan; None if A_cl is not Hurwitz (Assumption 6) or the slot is shorter than the quantum."""
        key = heard_by(laplacian)
        if key not in self._plans:
            self._plans[key] = self._computed(laplacian)
        return self._plans[key]

    def boot(self) -> RoundPlan:
        """Return the plan before a topology is known: no links, and a slot for each robot, so no frames collide."""
        robots = len(self._team.names)
        return RoundPlan(np.zeros((robots, robots)), tuple((number,) for number in range(robots)),
                         self._quantized(round(self._team.boot_slot_s * 1e9)))

    def _computed(self, laplacian: Floats) -> RoundPlan | None:
        try:
            plan = plan_round(self._team.agents, laplacian, bound=self._team.slot_bound, kappa=self._team.kappa,
                              max_successive_losses=self._team.max_successive_losses)
        except ValueError:
            return None
        slot_ns = self._quantized(plan.slot_ns)
        if self._team.slot_us:
            certified_ns = slot_ns if self._team.hold is Hold.VALUE else 0      # (6.20) says nothing about models
            return RoundPlan(plan.laplacian, plan.parts, max(1, round(self._team.slot_us * 1000)), certified_ns)
        return RoundPlan(plan.laplacian, plan.parts, slot_ns) if slot_ns else None

    def _quantized(self, slot_ns: int) -> int:
        """Round down to quanta, so that robots whose arithmetic differs in the last bit agree; 0 below one quantum."""
        quantum_ns = max(1, round(self._team.slot_quantum_s * 1e9))
        return slot_ns // quantum_ns * quantum_ns

    def table_entry(self, laplacian: Floats) -> TableEntry | None:
        plan = self.plan(laplacian)
        if plan is None:
            return None
        heard = [list(numbers) for numbers in heard_by(laplacian)]
        return TableEntry(heard, [list(part) for part in plan.parts], plan.slot_ns, plan.certified_ns, plan.assumed_ns)

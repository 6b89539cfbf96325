"""The round plan that every agent computes from a topology: when each agent broadcasts (sections 6.3.2 and 6.3.3).

    slot       0    1   ...  T-1  |  0    1   ...          slot k of a round starts k tau after the round
    part       P_1  P_2 ...  P_T  |  P_1  P_2 ...          and its part broadcasts at that instant

Every agent computes the same plan from the same Laplacian, so no plan is sent.

Differs from the dissertation: Protocol 1 counts parts modulo T, the number of nonempty parts, not modulo N; with N,
some slots of each round would stay idle.
Not modelled: airtime and guard times; the robot program adds them within the slot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from agents.synchronization.closed_loop import ClosedLoop, LinearAgent
from agents.synchronization.graph import Floats
from agents.synchronization.partition import Parts, partition
from agents.synchronization.slot_length import KAPPA, Bound, SlotLength, small_gain_tau_s


@dataclass(frozen=True, eq=False)
class RoundPlan:
    """One topology with its broadcasting order and slot length."""

    laplacian: Floats
    parts: Parts
    slot_ns: int
    certified_ns: int = 0               # slot length by (6.20), if `slot_ns` differs from it; 0: the same
    assumed_ns: int = 0                 # longest delay of its links, with which the exact loop is stable; 0: unknown

    def __post_init__(self) -> None:
        spoken = sorted(agent for part in self.parts for agent in part)
        if spoken != list(range(len(self.laplacian))):
            raise ValueError(f"parts {self.parts}: each of the {len(self.laplacian)} agents belongs to one part, once")
        if self.slot_ns < 1:
            raise ValueError(f"slot_ns={self.slot_ns}: expected at least 1 ns")

    @property
    def round_ns(self) -> int:
        return len(self.parts) * self.slot_ns


def plan_round(agents: Sequence[LinearAgent], laplacian: Floats, *, bound: Bound = Bound.PRINTED, kappa: float = KAPPA,
               max_successive_losses: int = 0) -> RoundPlan:
    """Return the plan of one topology: partition and slot length; ValueError if A_cl is not Hurwitz (Assumption 6)."""
    loop = ClosedLoop(tuple(agents), laplacian)
    parts = partition(loop.laplacian)
    tau_s = small_gain_tau_s(loop, len(parts), bound)
    length = SlotLength(tau_s, len(parts), kappa, max_successive_losses)
    return RoundPlan(loop.laplacian, parts, length.slot_ns)

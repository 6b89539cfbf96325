"""A switching signal with which one agent never broadcasts: the reason why a topology must not change at every slot.

Slot k of a round belongs to the k-th part of the topology in force. If the topology may change at every slot, each slot
can have one in which the agent's part is another. Then the agent never broadcasts although every topology alone is
stable; if the agent is unstable without the others, the team diverges.

Differs from the dissertation: section 6.5 and Remark 18 take min tau as an admissible dwell time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.exact_loop import ExactLoop
from agents.synchronization.graph import Floats
from agents.synchronization.round_plan import RoundPlan


def starving_signal(plans: Sequence[RoundPlan], agent: int) -> tuple[int, ...] | None:
    """Return the plan in force in each slot of a round such that `agent` never broadcasts; None if there is none.

    Of several plans that keep it silent, one that differs from the slot before is taken. Raises ValueError unless all
    plans have the same number of parts.
    """
    rounds = {len(plan.parts) for plan in plans}
    if len(rounds) != 1:
        raise ValueError(f"plans with {sorted(rounds)} parts: a signal for all rounds needs the same number in each")
    signal: list[int] = []
    for slot in range(rounds.pop()):
        silent = [p for p, plan in enumerate(plans) if agent not in plan.parts[slot]]
        if not silent:
            return None
        changes = [p for p in silent if signal and p != signal[-1]]
        signal.append((changes or silent)[0])
    return tuple(signal)


def signal_map(agents: Sequence[LinearAgent], plans: Sequence[RoundPlan], signal: Sequence[int]) -> Floats:
    """Return the exact map of z = (x, y^) over len(signal) slots, slot k in topology signal[k]; all agents hear all."""
    loops = [ExactLoop(tuple(agents), plan.laplacian, plan.parts) for plan in plans]
    M = np.eye(sum(loops[0].closed_loop.C_cl.shape))
    for k, p in enumerate(signal):
        M = loops[p].slot_map(k % len(plans[p].parts), plans[p].slot_ns * 1e-9) @ M
    return M

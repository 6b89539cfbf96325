"""Certificate that the team synchronizes although the topology switches within rounds, if each holds for m slots.

The count of slots runs on through a switch: slot k belongs to part k mod T of the topology in force. A stay in one
topology lasts m slots or more, and every such number is a sum of numbers from m to 2 m - 1. So with a function
V_f = z' P_f z for each phase f = k mod T, and one exact map for each phase, topology and number of slots n,

    M' P_{f+n mod T} M <= exp(-2 alpha h) P_f        n = m, ..., 2 m - 1,  h = n tau_p

bounds every signal with that dwell: |z| <= c exp(-alpha t) |z(0)| at switches. One quadratic function of all phases is
too few: it would have to decay from every phase to every other.

A dwell of one slot is not enough if `starving` has a signal that keeps an unstable agent silent.

Differs from the dissertation: section 6.5 takes min tau, one slot, as an admissible dwell time.
Not modelled: topologies with different numbers of parts; new links without a value (every agent hears every broadcast,
`Hearing.EVERYONE`); what `dwell_time` does not model either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.common_lyapunov import Step, search_several, step_rates_per_s
from agents.synchronization.dwell_time import RATE_KEPT, decay_problems
from agents.synchronization.exact_loop import ExactLoop
from agents.synchronization.graph import Floats
from agents.synchronization.round_plan import RoundPlan


@dataclass(frozen=True, eq=False)
class SlotDwellCertificate:
    """If `problems` is empty, the state converges at `rate_per_s` for every signal with the dwell of `steps`."""

    steps: tuple[Step, ...]         # of the least numbers of slots; before and after are phases
    P: tuple[Floats, ...]           # one for each phase
    rate_per_s: float

    def problems(self) -> list[str]:
        found = [] if self.rate_per_s > 0 else [f"the rate is {self.rate_per_s:.3g} per second: expected above 0"]
        for step in self.steps:
            factor = float(np.exp(-2 * self.rate_per_s * step.duration_s))
            found += decay_problems(f"phase {step.before}, {step.duration_s:.6g} s", self.P[step.after], step.M, factor,
                                    self.P[step.before])
        return found

    @property
    def holds(self) -> bool:
        return not self.problems()

    @property
    def overshoot(self) -> float:
        """The factor in |z(t)| <= overshoot exp(-rate t) |z(0)|, for t at ends of stays."""
        ends = [np.linalg.eigvalsh(P)[[0, -1]] for P in self.P]
        return float(np.sqrt(max(high for _, high in ends) / min(low for low, _ in ends)))


def stay_steps(agents: Sequence[LinearAgent], plans: Sequence[RoundPlan], dwell_slots: int) -> tuple[Step, ...]:
    """Return the maps of stays of dwell_slots to 2 dwell_slots - 1 slots, from each phase in each topology.

    Raises ValueError unless all plans have the same number of parts and dwell_slots >= 1."""
    rounds = {len(plan.parts) for plan in plans}
    if len(rounds) != 1 or dwell_slots < 1:
        raise ValueError(f"dwell_slots={dwell_slots}, plans with {sorted(rounds)} parts: expected 1 or more, and the "
                         "same number of parts in each plan, or a slot has no part")
    parts = rounds.pop()
    steps = []
    for plan in plans:
        loop, tau_s = ExactLoop(tuple(agents), plan.laplacian, plan.parts), plan.slot_ns * 1e-9
        slots = [loop.slot_map(slot, tau_s) for slot in range(parts)]
        for phase in range(parts):
            M = np.eye(len(slots[0]))
            for n in range(1, 2 * dwell_slots):
                M = slots[(phase + n - 1) % parts] @ M
                if n >= dwell_slots:
                    steps.append(Step(phase, (phase + n) % parts, M, n * tau_s))
    return tuple(steps)


def slot_dwell_certificate(agents: Sequence[LinearAgent], plans: Sequence[RoundPlan],
                           dwell_slots: int) -> SlotDwellCertificate:
    """Return a certificate with the best functions found; its `holds` says whether it is valid."""
    steps = stay_steps(agents, plans, dwell_slots)
    rounds = [ExactLoop(tuple(agents), plan.laplacian, plan.parts).round_map(plan.slot_ns * 1e-9) for plan in plans]
    P = search_several(steps, rounds)
    found = min(step_rates_per_s(P, steps))
    return SlotDwellCertificate(steps, tuple(P), found - (1 - RATE_KEPT) * abs(found))

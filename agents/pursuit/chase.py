"""One pursuer and one evader without any network; the true distance is measured at every instant and in between.

    at instant k    apply the answers that are due;  if a look is due and the target is in view: y = place + noise,
                    answered `latency_steps` later, or lost;  decide;  measure the error of the estimate
    from k to k + 1 move the pursuer exactly by its law, and the evader; measure the distance to the boundary, PARTS
                    times

The looks that start the filter, one T_s apart, count as one look (section 3.3.1).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, sqrt

import numpy as np

from agents.pursuit import Place
from agents.pursuit.evaders import Evader
from agents.pursuit.pursuer import Pursuer
from agents.pursuit.sampling import FIRST_LOOKS

PARTS = 5                       # measurements of the distance per step


@dataclass(frozen=True)
class Instant:
    t_ns: int
    target: Place
    own: Place
    expected: Place
    seen: Place | None


@dataclass
class Chase:
    looks: int = 0              # counted as in the tables
    error_m: float = 0.0        # root of the mean squared distance between estimate and truth over all instants
    least_m: float = inf        # least signed distance from the target to the boundary, negative outside
    escaped_ns: int | None = None
    trace: list[Instant] = field(default_factory=list)

    def watch(self, distance_m: float, now_ns: int) -> None:
        self.least_m = min(self.least_m, distance_m)
        if distance_m < 0 and self.escaped_ns is None:
            self.escaped_ns = now_ns


def chase(pursuer: Pursuer, own: Place, evader: Evader, rng: np.random.Generator, *, instants: int, step_ns: int,
          sigma_m: float, latency_steps: int = 0, lost_in_a_row: int = 0, traced: bool = False) -> Chase:
    """Run one chase of `instants` steps; ValueError for numbers out of range.

    `own` is the pursuer's initial place. `rng` draws one pair of normal variables at each instant, with or without a
    look. After each answer that arrives, `lost_in_a_row` answers are lost.
    """
    if instants < 1 or latency_steps < 0 or lost_in_a_row < 0:
        raise ValueError(f"instants={instants}, latency_steps={latency_steps}, lost_in_a_row={lost_in_a_row}: expected "
                         f"at least 1, 0 and 0")
    found = Chase()
    noise = (sigma_m * rng.standard_normal((instants, 2))).tolist()
    answers: list[tuple[int, Place]] = []           # seen at, place
    target = evader.place
    look_ns = 0
    squares = 0.0
    found.watch(pursuer.zones.distance_m(own, target), 0)
    for k in range(instants):
        now_ns = k * step_ns
        seen = None
        if now_ns == look_ns:
            pursuer.asked(now_ns)
            if pursuer.zones.distance_m(own, target) >= 0 and found.looks % (lost_in_a_row + 1) == 0:
                seen = target[0] + noise[k][0], target[1] + noise[k][1]
                answers.append((now_ns, seen))
            found.looks += 1
        if answers and answers[0][0] + latency_steps * step_ns <= now_ns:
            pursuer.detected(now_ns, *answers.pop(0), own)
        decision = pursuer.step(now_ns, own)
        look_ns = decision.look_ns
        expected = decision.expected or own
        squares += (expected[0] - target[0]) ** 2 + (expected[1] - target[1]) ** 2
        if traced:
            found.trace.append(Instant(now_ns, target, own, expected, seen))
        for part in range(1, PARTS + 1) if k + 1 < instants else ():
            before = own
            if decision.goal:
                own = pursuer.law.moved(own, decision.goal, step_ns * 1e-9 / PARTS)
            target = evader.moved(step_ns * 1e-9 / PARTS, before)
            found.watch(pursuer.zones.distance_m(own, target), now_ns + part * step_ns // PARTS)
    found.looks -= min(found.looks, FIRST_LOOKS) - 1
    found.error_m = sqrt(squares / instants)
    return found

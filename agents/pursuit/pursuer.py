"""The decisions of one pursuer of one target (Figures 3.3 and 3.4). It neither waits nor sends; its caller does.

    step(now, own) -> Decision          decide where to drive from now on, and when to look next
    asked(look)                         the caller has requested a look with its exposure at `look`
    detected(now, seen, place, own)     the caller has received a detection, of its own sensor or another one

The caller calls `step` at every instant k T_s, as in Figure 3.3, or only one T_s before the instant `look_ns` of the
last decision, and requests the look unless the new decision names a later instant.

Only the newest detection sets goal and next look; the filter also gets older ones, which it orders by time stamp. The
age of a detection counts from its exposure, so a late answer makes the next look earlier.
"""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

from agents.estimation import Estimator, Inputs
from agents.pursuit import Place
from agents.pursuit.law import PursuitLaw
from agents.pursuit.no_escape import problems
from agents.pursuit.sampling import Sampling
from agents.pursuit.sampling.adaptive import Adaptive
from agents.pursuit.zones import Zones


class Decision(NamedTuple):
    look_ns: int                # earliest exposure of the next look
    goal: Place | None          # place to drive to (3.6); None: stay
    velocity_mps: Place         # velocity (3.6) at the place `own` of this call
    expected: Place | None      # expected place of the target now; None without a detection


class Pursuer:
    """Invariant: `goal` is the newest detection, or None if that was in the no-moving area."""

    def __init__(self, estimator: Estimator, sampling: Sampling, law: PursuitLaw, zones: Zones, rho_m: float) -> None:
        if not rho_m >= 0:
            raise ValueError(f"rho_m={rho_m}: expected 0 or more")
        self.estimator = estimator
        self.sampling = sampling
        self.law = law
        self.zones = zones
        self.seen_ns: int | None = None         # time of the newest detection
        self.goal: Place | None = None
        self._rho_m = rho_m

    def detected(self, now_ns: int, seen_ns: int, place: Place, own: Place, inputs: Inputs | None = None) -> bool:
        """Apply a detection; returns whether the filter accepted it.

        Raises ValueError, and changes nothing, for a place that is not finite or a time after now."""
        if seen_ns > now_ns:
            raise ValueError(f"detection at {seen_ns} ns, told of at {now_ns} ns: it is from the future; the sensor's "
                             f"clock is ahead, synchronize it")
        counted = self.estimator.correct(seen_ns, *place, inputs)
        if not counted or (self.seen_ns is not None and seen_ns < self.seen_ns):
            return counted
        self.seen_ns = seen_ns
        x, y = self.estimator.expect(seen_ns)
        self.sampling.detected(seen_ns, place, hypot(x - place[0], y - place[1]) >= self._rho_m)
        self.goal = None if self.zones.stays(own, place) else place
        return True

    def asked(self, look_ns: int) -> None:
        self.sampling.asked(look_ns)

    def step(self, now_ns: int, own: Place) -> Decision:
        seen = self.seen_ns is not None
        return Decision(self.sampling.next_look_ns(now_ns, own), self.goal,
                        self.law.velocity_mps(own, self.goal) if self.goal else (0.0, 0.0),
                        self.estimator.expect(now_ns) if seen else None)


def adaptive_pursuer(estimator: Estimator, zones: Zones, law: PursuitLaw, *, v_max_mps: float, sigma_m: float,
                     step_ns: int, rho_m: float, latency_ns: int = 0, losses: int = 0, sure: bool = True) -> Pursuer:
    """Return a pursuer with the adaptive policy; ValueError if a target may escape, unless `sure` is False.

    `latency_ns`: longest time from an exposure to its answer; `losses`: most answers lost in a row.
    """
    wrong = problems(zones, law, v_max_mps, sigma_m, step_ns, latency_ns, losses)
    if sure and wrong:
        raise ValueError("\n".join(wrong))
    return Pursuer(estimator, Adaptive(step_ns, zones, v_max_mps, latency_ns), law, zones, rho_m)

"""One pursuer of one target, event by event (Figures 3.3 and 3.4): it neither waits nor sends; whoever drives it does.

    step(now, own) -> Decision          where to drive from now on, and when to look next
    asked(look)                         it was asked for a look with its exposure then
    detected(now, seen, place, own)     an answer has come, from its own sensor or another's

`step` may be called at any time; to get a decision as Figure 3.3 has it, at every instant k T_s, or only one T_s before
the instant that the last decision names: it looks there unless this later decision names a later one.

A detection moves the pursuer, and sets its next look, if it is the newest; the filter takes older ones by their time
stamps as far as it can. The newest counts as of when it was made, so late answers make the pursuer look earlier.
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
    look_ns: int                # the next look, not before
    goal: Place | None          # what it drives to (3.6); None: it stays
    velocity_mps: Place         # now, for a pursuer that is where it said
    expected: Place | None      # of the target, now; None: it was never seen


class Pursuer:
    """Invariant: `goal` is the newest detection, or None if that was in the no-moving area."""

    def __init__(self, estimator: Estimator, sampling: Sampling, law: PursuitLaw, zones: Zones, rho_m: float) -> None:
        if not rho_m >= 0:
            raise ValueError(f"rho_m={rho_m}: expected 0 or more")
        self.estimator = estimator
        self.sampling = sampling
        self.law = law
        self.zones = zones
        self.seen_ns: int | None = None         # the newest detection
        self.goal: Place | None = None
        self._rho_m = rho_m

    def detected(self, now_ns: int, seen_ns: int, place: Place, own: Place, inputs: Inputs | None = None) -> bool:
        """Whether it counted. ValueError for one that is no place, or is from the future; nothing has changed then."""
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
    """A pursuer with the adaptive policy that no target escapes. ValueError if it may; `sure=False`: all the same.

    `latency_ns`: from an exposure to its answer, at most; `losses`: answers lost in a row, at most.
    """
    wrong = problems(zones, law, v_max_mps, sigma_m, step_ns, latency_ns, losses)
    if sure and wrong:
        raise ValueError("\n".join(wrong))
    return Pursuer(estimator, Adaptive(step_ns, zones, v_max_mps, latency_ns), law, zones, rho_m)

"""Detections that arrive out of order: restore the filter from before an older one, then apply all newer ones again.

    before(t_1), t_1,  before(t_2), t_2,  ...       the last `keep` detections, each with a copy of the filter before it

Wraps a filter whose state holds no detections (`UnscentedKalman`, `ParticleFilter`): detections that arrive out of
order then lead to the same state as in order, draws of noise included. `CircleFilter` needs no wrapper.

Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001: the
reprocessing of stored measurements. Not modelled: retrodiction, which needs no store but is approximate here.
"""

from __future__ import annotations

from copy import deepcopy
from typing import NamedTuple

from agents.estimation import Estimator, Inputs


class Seen(NamedTuple):
    t_ns: int
    x_m: float
    y_m: float
    inputs: Inputs | None


class Replayed:
    """Invariant: `_past` is in order of time, no time twice; a detection that is refused changes nothing."""

    def __init__(self, estimator: Estimator, keep: int = 5) -> None:
        if keep < 1:
            raise ValueError(f"keep={keep}: expected 1 or more detections to go back to")
        self._estimator = estimator
        self._keep = keep
        self._past: list[tuple[Estimator, Seen]] = []

    def expect(self, t_ns: int) -> tuple[float, float]:
        return self._estimator.expect(t_ns)

    def correct(self, t_ns: int, x_m: float, y_m: float, inputs: Inputs | None = None) -> bool:
        at = sum(seen.t_ns < t_ns for _, seen in self._past)
        newer = [seen for _, seen in self._past[at:]]
        if newer and newer[0].t_ns == t_ns:
            raise ValueError(f"detection at {t_ns} ns: there is one with this time stamp already; keep one of them")
        if newer and at == 0 and len(self._past) == self._keep:
            return False
        estimator = self._past[at][0] if newer else self._estimator
        past = self._past[:at]
        for seen in (Seen(t_ns, x_m, y_m, inputs), *newer):
            before = deepcopy(estimator)
            if not estimator.correct(*seen):
                return False
            past.append((before, seen))
        self._estimator, self._past = estimator, past[-self._keep:]
        return True

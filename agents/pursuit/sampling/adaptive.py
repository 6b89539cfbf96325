"""The policy of Figure 3.3: look when the target may be near the boundary, or when the filter's error is large.

    d(m) = R - |y - q(m)| - v_max (m T_s - t_seen)      the least possible distance to the boundary at m (3.4)
    look at m + 1   if d(m) <= zeta, or after the newest detection |expected - y| >= rho

The reachable set of the target is a disk of radius v_max (t - t_seen) around the newest detection y.
An answer takes up to `latency_ns` from the exposure. Meanwhile d goes on falling, but no other look is requested: each
could report a large error again, which with a latency of 3 T_s made 145 looks instead of 37.
A look without an answer by then is requested again, since the target may have left the view.
"""

from __future__ import annotations

from math import hypot

from agents.pursuit import Place
from agents.pursuit.sampling import FIRST_LOOKS, check_step
from agents.pursuit.zones import Zones


class Adaptive:
    def __init__(self, step_ns: int, zones: Zones, v_max_mps: float, latency_ns: int = 0,
                 first_looks: int = FIRST_LOOKS) -> None:
        check_step(step_ns)
        if not 0 < v_max_mps * step_ns * 1e-9 < zones.radius_m:
            raise ValueError(f"v_max_mps={v_max_mps}: expected more than 0, and less than leaves the field of view of "
                             f"{zones.radius_m} m in one step")
        if latency_ns < 0:
            raise ValueError(f"latency_ns={latency_ns}: expected 0 or more")
        self._step_ns = step_ns
        self._reach_m = zones.radius_m - zones.escape_m
        self._v_max_mps = v_max_mps
        self._latency_ns = latency_ns
        self._first_looks = first_looks
        self._asked_ns = -1
        self._seen_ns = -1
        self._place: Place | None = None
        self._surprised = False

    def asked(self, look_ns: int) -> None:
        self._first_looks -= 1
        self._asked_ns = look_ns

    def detected(self, seen_ns: int, place: Place, surprised: bool) -> None:
        self._seen_ns, self._place, self._surprised = seen_ns, place, surprised

    def next_look_ns(self, now_ns: int, own: Place) -> int:
        step_ns = self._step_ns
        soonest_ns = (now_ns // step_ns + 1) * step_ns
        if self._first_looks > 0:
            return soonest_ns
        if self._asked_ns > self._seen_ns:                                  # wait for the answer to the last look
            retry_ns = self._asked_ns + self._latency_ns
            soonest_ns = max(soonest_ns, (retry_ns // step_ns + 1) * step_ns)
        if self._surprised or self._place is None:
            return soonest_ns
        left_m = self._reach_m - hypot(self._place[0] - own[0], self._place[1] - own[1])
        doubt_ns = self._seen_ns + int(left_m / self._v_max_mps * 1e9)      # d = zeta, if the pursuer stays
        if doubt_ns <= now_ns:
            return soonest_ns
        return max(soonest_ns, (-(-doubt_ns // step_ns) + 1) * step_ns)     # one step after the next instant

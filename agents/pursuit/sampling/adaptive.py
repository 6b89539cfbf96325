"""The decision of Figure 3.3: look where the target may have come near the boundary, or the filter is off.

    d(m) = R - |y - q(m)| - v_max (m T_s - t_seen)      the least distance to the boundary that is possible at m (3.4)
    look at m + 1   if d(m) <= zeta, or after the newest detection |expected - y| >= rho

v_max (t - t_seen) is the escape time's other side: the reachable set of the target is a disk around what was seen.
Answers come up to `latency_ns` after the exposure; meanwhile d goes on falling, and no further look is asked for: each
would bring its own surprises; with a latency of 3 T_s that made four times as many looks (145 instead of 37).
A look without an answer by then is asked for again, since the target may be gone.
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
        if self._asked_ns > self._seen_ns:                                  # under way: until then it may be answered
            retry_ns = self._asked_ns + self._latency_ns
            soonest_ns = max(soonest_ns, (retry_ns // step_ns + 1) * step_ns)
        if self._surprised or self._place is None:
            return soonest_ns
        left_m = self._reach_m - hypot(self._place[0] - own[0], self._place[1] - own[1])
        doubt_ns = self._seen_ns + int(left_m / self._v_max_mps * 1e9)      # d = zeta, if the pursuer stays
        if doubt_ns <= now_ns:
            return soonest_ns
        return max(soonest_ns, (-(-doubt_ns // step_ns) + 1) * step_ns)     # tested at the instant at or after it

"""Sampling policies: a member of this kind decides when the next look is due.

    asked(look_ns)                          the pursuer has requested a look with its exposure at look_ns
    detected(seen_ns, place, surprised)     the newest detection; `surprised`: the filter's error exceeds rho
    next_look_ns(now_ns, own)               return the first instant after now at which to look

The returned instant holds until the next detection, as long as the pursuer, now at `own`, does not recede from the last
one; a later call may return a later instant, never an earlier one. Instants are multiples of T_s. The first looks, from
which the filter starts, are at consecutive instants.
"""

from __future__ import annotations

from typing import Protocol

from agents.pursuit import Place

FIRST_LOOKS = 3                 # detections that define a circle


class Sampling(Protocol):
    def asked(self, look_ns: int) -> None: ...

    def detected(self, seen_ns: int, place: Place, surprised: bool) -> None: ...

    def next_look_ns(self, now_ns: int, own: Place) -> int: ...


def check_step(step_ns: int) -> None:
    if step_ns < 1:
        raise ValueError(f"step_ns={step_ns}: expected 1 or more")
